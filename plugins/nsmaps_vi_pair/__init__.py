"""The vibro-impact pair: a ball in a harmonically shaken capsule, the energy harvester of the paper."""

from nsmaps_vi_pair.system import VIPair

__all__ = ["VIPair"]
