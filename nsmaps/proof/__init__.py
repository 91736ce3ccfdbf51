"""Proofs by computation: certificates are computed here and checked in `nsmaps.verify`."""
