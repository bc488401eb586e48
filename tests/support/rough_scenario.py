"""A random rough surface under three moves, small enough to compute its history several times."""

SCENARIO = """
title = "Rough contact"
[materials]
first = "silicon"
second = "float glass"
[surface]
kind = "random"
shape = [48, 48]
pixel_size = "1 µm"
rms_height = "50 nm"
autocorrelation_length = "4 µm"
seed = 1
[friction]
coefficient = 0.2
[loading]
waypoints = [
    { time = 0, normal_load = "50 mN" },
    { time = 1, tangential_displacement = "30 nm" },
    { time = 2, tangential_displacement = "-30 nm", name = "turned" },
    { time = 3, tangential_displacement = "30 nm" },
]
substeps = 15
"""
