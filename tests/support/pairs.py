"""Pairs of materials that many tests use."""

import historysim as hs

GLASS = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
#: E* = θ = 1
UNIT = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
