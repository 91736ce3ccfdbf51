"""Izhikevich's neuron."""

from nsmaps_neuron.system import Neuron

__all__ = ["Neuron"]
