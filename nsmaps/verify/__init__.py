"""The check of certificates, by code of its own."""
