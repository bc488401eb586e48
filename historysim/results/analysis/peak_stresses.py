"""Largest stresses below each asperity over a history, and the slip at its edge."""

from typing import TYPE_CHECKING, Any

import numpy as np

from historysim.asperities.asperity import Asperity
from historysim.contact.subsurface import largest_principal, von_mises
from historysim.results.analysis.recorded import check_recorded, describe
from historysim.results.queries import query
from historysim.results.recompute import replay_asperities
from historysim.results.source import ReplaySource, query_source

if TYPE_CHECKING:
    import xarray as xr

# Section y = 0 in contact radii, in which the largest stresses are by symmetry; refined around its
# largest values.
SECTION_X, SECTION_Z = (
    np.linspace(-1.25, 1.25, 41),
    np.concatenate([[0.0, 0.01, 0.03], np.linspace(0.06, 1.0, 19)]),
)
ZOOMS, ZOOM_FACTOR = 3, 0.2  # refinements of the section: to 1/2,000 of the contact radius
MEASURES = {"tensile": largest_principal, "von_mises": von_mises}
TEXTS = {
    "tensile": "largest principal stress, tension positive",
    "von_mises": "largest von Mises stress",
}
SLIP_POINTS = 256  # of the mean of the anchors over the angle: to 1e-5 of the slip


@query(table="asperity,tensile")
def peak_stress(history: "xr.Dataset", poissons_ratio: float | str | None = None) -> "xr.Dataset":
    """Return the largest tensile and von Mises stress of each asperity over the steps, with its amplitude of slip.

    Stresses are those of `Asperity.stress`, searched in the section through the middle of the
    contact along the tangential load; positions are in the frame in which the traction of the step
    points towards positive x.

    Parameters
    ----------
    history : xarray.Dataset
        As for `asperity`.
    poissons_ratio : float or str, optional
        Of the body below the surface, or ``"first"`` or ``"second"`` body of the replay; by default
        the second one.

    Returns
    -------
    xarray.Dataset
        Along ``asperity``: ``tensile`` and ``von_mises`` [Pa], each with ``_step``, ``_x`` and
        ``_z``, its step and position [m], -1 and 0 for an asperity that never touches;
        ``slip_amplitude`` [m], half the range of the slip at the smallest contact radius since the
        last lift-off. The product of ``tensile``, the largest traction and the slip amplitude is
        Ruiz' parameter of crack initiation (Ruiz, Boddington and Chen 1984).

    Raises
    ------
    InputError
        As for `asperity`, or if Poisson's ratio is unknown.
    """
    import xarray as xr

    check_recorded(history, "contact_radius")
    poissons_ratio = history_poissons_ratio(history, poissons_ratio)
    labels = history["asperity"].values
    radii = history["contact_radius"].values
    columns: dict[str, list[Any]] = {
        f"{name}{end}": [] for name in MEASURES for end in ("", "_step", "_x", "_z")
    }
    slips = []
    for column, label in enumerate(labels):
        steps = np.flatnonzero(radii[:, column] > 0.0)
        contacts = replay_asperities(history, int(label), steps.tolist()) if steps.size else []
        for name, (index, *peak) in _peaks(contacts, poissons_ratio).items():
            columns[f"{name}_step"].append(int(steps[index]) if contacts else -1)
            for end, value in zip(("", "_x", "_z"), peak, strict=True):
                columns[name + end].append(value)
        lifted = steps[1:][np.diff(steps) > 1]
        since = contacts if not lifted.size else contacts[np.searchsorted(steps, lifted[-1]) :]
        slips.append(slip_amplitude(since))
    variables = {}
    for name, text in TEXTS.items():
        variables[name] = describe("asperity", columns[name], text, "Pa")
        variables[f"{name}_step"] = describe(
            "asperity", columns[f"{name}_step"], f"step of the {text}; -1: never touches"
        )
        for axis, meaning in (("x", "along the traction"), ("z", "below the surface")):
            values = columns[f"{name}_{axis}"]
            variables[f"{name}_{axis}"] = describe(
                "asperity", values, f"position of the {text}, {meaning}", "m"
            )
    variables["slip_amplitude"] = describe(
        "asperity", slips, "half the range of the slip at the edge", "m"
    )
    coordinates = {
        key: value for key, value in history.coords.items() if value.dims == ("asperity",)
    }
    return xr.Dataset(variables, coordinates)


def history_poissons_ratio(
    history: "xr.Dataset", poissons_ratio: float | str | None
) -> float | str | None:
    """Resolve Poisson's ratio by the materials of the replay that a history comes from; None if it has none."""
    if isinstance(poissons_ratio, float | int):
        return poissons_ratio

    def read_ratio(origin: ReplaySource) -> float | None:
        pair = origin.job.ensemble.pair
        body = pair.first if poissons_ratio == "first" else pair.second
        return None if body is None else float(body.poissons_ratio)

    ratio = query_source(history, read_ratio)
    return poissons_ratio if ratio is None else ratio


def _peaks(
    contacts: list[Asperity], poissons_ratio: float | str | None
) -> dict[str, tuple[int, float, float, float]]:
    """Return the index of the contact, the stress and its position x and z for each measure."""
    peaks = dict.fromkeys(MEASURES, (0, 0.0, 0.0, 0.0))
    for index, contact in enumerate(contacts):
        for name in MEASURES:
            peak = find_peak(contact, name, poissons_ratio)
            if peak[0] > peaks[name][1]:
                peaks[name] = (index, *peak)
    return peaks


def find_peak(
    contact: Asperity, measure: str, poissons_ratio: float | str | None = None
) -> tuple[float, float, float]:
    """Return the largest stress of a measure below a contact [Pa], and its position x and z [m]."""
    radius = contact.contact_radius
    x = radius * SECTION_X
    z = radius * SECTION_Z
    width = x[1] - x[0], z[-1] - z[-2]
    best = (-np.inf, 0.0, 0.0)
    for _ in range(ZOOMS + 1):
        stress = MEASURES[measure](
            contact.stress(x[:, np.newaxis], 0.0, z, poissons_ratio=poissons_ratio)
        )
        row, column = np.unravel_index(stress.argmax(), stress.shape)
        best = max(best, (float(stress[row, column]), float(x[row]), float(z[column])))
        around = np.linspace(-1.0, 1.0, 11)
        x = best[1] + width[0] * around
        z = np.unique(np.maximum(best[2] + width[1] * around, 0.0))
        width = width[0] * ZOOM_FACTOR, width[1] * ZOOM_FACTOR
    return best


def slip_amplitude(contacts: list[Asperity]) -> float:
    """Return half the range of the slip at the smallest contact radius of the states of an asperity [m].

    The slip of the surface at a radius r is the mean of the anchors of the springs over the angle
    φ, at r sin φ: the displacement of the surface is that mean of the deflections (Popov and Heß
    2015).
    """
    if not contacts:
        return 0.0
    radius = min(contact.contact_radius for contact in contacts)
    angle = (np.arange(SLIP_POINTS) + 0.5) * (np.pi / 2 / SLIP_POINTS)
    slips = [float(contact.anchor(radius * np.sin(angle)).mean()) for contact in contacts]
    return (max(slips) - min(slips)) / 2
