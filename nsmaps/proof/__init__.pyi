"""Proofs by computation: certificates are computed here and checked in `nsmaps.verify`."""

from nsmaps.proof.cycles import certificate_of as certificate_of
from nsmaps.verify.certificate import write_certificate as write_certificate
