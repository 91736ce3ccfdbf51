"""The vibro-impact pair whose capsule recoils: a ball in a capsule of finite mass on a weak spring."""

from nsmaps_recoil_pair.system import RecoilPair

__all__ = ["RecoilPair"]
