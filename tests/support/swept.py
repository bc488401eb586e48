"""Scenarios to sweep over, and what one ball gives in closed form."""

BALL = """
title = "a ball"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "sphere"
radius = "2.5 mm"
[friction]
coefficient = 0.2
[loading]
substeps = 4
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, normal_load = "50 mN", tangential_displacement = "5 nm" },
    { time = 2, normal_load = "70 mN", tangential_displacement = "-5 nm" },
]
"""
ROUGH = BALL.replace(
    'kind = "sphere"\nradius = "2.5 mm"',
    'kind = "random"\nshape = [32, 32]\npixel_size = "1 µm"\n'
    'rms_height = "20 nm"\nautocorrelation_length = "6 µm"\nseed = 1',
)
CONTACT_MODULUS = 1 / ((1 - 0.28**2) / 112e9 + (1 - 0.2**2) / 64e9)
SHEAR_MODULUS = 1 / ((2 - 0.28) / 44e9 + (2 - 0.2) / 26e9)


def displacement(load, friction, radius):
    """Preliminary displacement of one ball, by Hertz and Mindlin."""
    approach = (9 * load**2 / (16 * CONTACT_MODULUS**2 * radius)) ** (1 / 3)
    return CONTACT_MODULUS / (4 * SHEAR_MODULUS) * friction * approach
