"""Statistics of a height map: heights, slopes and curvatures, autocorrelation, power spectral density.

Axis 0 of a map runs along x, axis 1 along y; NaN marks missing points. A profile, (n, 1) or (1, n), has statistics
along its long axis only. Form and tilt count as roughness unless they are removed first; only the power spectral
density of a surface that is not periodic removes the mean plane by itself.
"""

from historysim.surfaces.statistics.correlation import Autocorrelation, autocorrelation
from historysim.surfaces.statistics.height_moments import HeightStatistics, height_statistics
from historysim.surfaces.statistics.spectral_moments import SpectralMoments
from historysim.surfaces.statistics.spectrum import PowerSpectralDensity, power_spectral_density

__all__ = [
    "Autocorrelation",
    "HeightStatistics",
    "PowerSpectralDensity",
    "SpectralMoments",
    "autocorrelation",
    "height_statistics",
    "power_spectral_density",
]
