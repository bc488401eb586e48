# Surfaces and their summits, each with its module.

from historysim.surfaces.distribution import drawn_summits as drawn_summits
from historysim.surfaces.distribution import quantile_summits as quantile_summits
from historysim.surfaces.distribution import textured_summits as textured_summits
from historysim.surfaces.heights import Surface as Surface
from historysim.surfaces.random import random_surface as random_surface
from historysim.surfaces.reading import read_surface as read_surface
from historysim.surfaces.summits import Summits as Summits
