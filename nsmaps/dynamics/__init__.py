"""What any return map does, exact or fitted alike."""
