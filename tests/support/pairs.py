"""Pairs of materials that many tests use."""

import historysim as hs

GLASS = hs.MaterialPair(hs.material("silicon"), hs.material("float glass"))
#: E* = θ = 1
UNIT = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
STIFF = hs.MaterialPair.from_moduli(contact_modulus=1e11, shear_modulus=2e10)
COMPLIANT = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=8e9)
#: E* and θ are not 1, and θ is not E*
PLAIN = hs.MaterialPair.from_moduli(contact_modulus=2.0, shear_modulus=0.3)
