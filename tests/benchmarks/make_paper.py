"""Write the paper page: its results (paper.json), its figures and its text with the numbers filled in.

    PYTHONPATH=tests/support:data/certified python tests/benchmarks/make_paper.py [--measure]

`paper.txt` is the text, with a {name} for each number. Without ``--measure`` the numbers are those
of `paper.json`, and only page and figures are made again.
"""

import json
import sys
import textwrap
import time
from pathlib import Path

import adapters
import numpy as np
import score
from matplotlib.figure import Figure

import historysim as hs

FOLDER = Path(__file__).parents[1] / "verification"
RESULTS, TEXT, PAGE = (FOLDER / f"paper.{ending}" for ending in ("json", "txt", "md"))
PICTURES = FOLDER / "pictures"
CODES = score.FOLDER / "results"
STEPS = (1, 3, 10, 30, 100, 300, 1000)
SIZES = (100, 1_000, 10_000, 100_000)
REVERSALS = (0.7, -0.2, 0.35)  # of full slip
LABELS = {
    "historysim": "historysim",
    "vector_springs": "springs, pulled back to a circle",
    "mindlin_deresiewicz": "Mindlin–Deresiewicz by increments",
    "lammps": "LAMMPS, mindlin_rescale",
}


# -- results ---------------------------------------------------------------------------------------


def measure_steps(counts=STEPS):
    """Largest error of T on case 03 over the steps of a leg, by law [μN]."""
    name = "03_nested_varying_load"
    case, columns = score.read_case(name)
    laws = {
        "vector_springs": lambda motion: adapters.springs(motion, 1000)[0],
        "mindlin_deresiewicz": lambda motion: adapters.mindlin_deresiewicz(motion)[0],
        "slider": lambda motion: adapters.slider(motion, rescaled=True)[0],
    }
    unit = case["units"]["T"]
    found = {"steps": list(counts)}
    for law, run in laws.items():
        errors = []
        for steps in counts:
            loads = run(adapters.build_motion(case, columns, steps))[::steps]
            errors.append(float(np.abs(loads - columns["T"]).max() / unit))
        found[law] = errors
    found["historysim"] = [
        float(np.abs(replay_in_parts(case, columns, steps) - columns["T"]).max() / unit)
        for steps in counts
    ]
    return found


def replay_in_parts(case, columns, steps):
    """Total tangential load of historysim at the rows of a case, each leg in equal events."""
    motion = adapters.build_motion(case, columns, steps)
    pair = hs.MaterialPair.from_moduli(
        contact_modulus=case["contact_modulus"], shear_modulus=case["shear_modulus"]
    )
    contact = hs.Ensemble(pair, 0.0, case["summit_radius"][0], friction=case["friction"])
    state, loads = contact.initial_state(), []
    for depth, displacement in zip(motion.depth[:, 0], motion.displacement, strict=True):
        state = contact.advance(
            state, normal_displacement=depth, tangential_displacement=displacement
        )
        loads.append(float(state.tangential_load))
    return np.array(loads[::steps])


def measure_sizes(loops=50):
    """Time of the processor for an event, over the number of asperities [µs], totals alone."""
    found = []
    pair = hs.MaterialPair.from_moduli(contact_modulus=4e10, shear_modulus=1e10)
    for count in SIZES:
        height = np.random.default_rng(3).normal(0.0, 1e-8, count)
        contact = hs.Ensemble(pair, height, 1e-5, friction=0.2)
        depth = height.max() - height.min()
        events = [hs.NormalDisplacement(0.0, 1.2 * depth)]
        events += [
            hs.TangentialDisplacement(turn + 1.0, depth / 20 * (-1.0) ** turn)
            for turn in range(loops)
        ]
        job = hs.Replay(contact, events, record="totals", substeps=20)
        times = []
        for _ in range(3):
            start = time.process_time()
            job.dataset()
            times.append(time.process_time() - start)
        found.append(1e6 * min(times) / (20 * loops))
    return {"sizes": list(SIZES), "microseconds": found}


def score_codes():
    """Scores of the codes whose results lie beside the cases."""
    found = {}
    for code in LABELS:
        scores = score.score_folder(CODES / code)
        cases = scores["cases"].items()
        loads = {name: score.largest_of(each, "T") if each else None for name, each in cases}
        energy = {name: score.largest_of(each, "E") if each else None for name, each in cases}
        ratios = {name: each["ratio"] if each else None for name, each in cases}
        found[code] = {
            "mean": scores["geometric_mean"],
            "exact": scores["verdicts"].get("exact", 0),
            "failures": scores["failures"],
            "loads": loads,
            "energy": energy,
            "ratios": ratios,
        }
    return found


def measure():
    """All results of the page."""
    return {"steps": measure_steps(), "sizes": measure_sizes(), "codes": score_codes()}


# -- figures: one idea each ------------------------------------------------------------------------


def canvas(width=3.4, height=2.6):
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots()


def draw_memory(_):
    """The memory of a contact after two reversals, in its cone."""
    pair = hs.MaterialPair.from_moduli(contact_modulus=1.0, shear_modulus=0.25)
    ball = hs.Asperity(pair, radius=1.0, friction=1.0).advance(normal_displacement=1.0)
    for displacement in REVERSALS:
        ball = ball.advance(tangential_displacement=displacement)
    radius = np.sqrt(np.linspace(0, 1, 400))
    figure, axes = canvas()
    label = radius**2
    axes.fill_between(label, label - 1, 1 - label, color="0.92", label="friction limit")
    axes.plot(label, REVERSALS[-1] - ball.anchor(radius), label="deflection v")
    axes.set(xlabel="label s: approach at first touch / d", ylabel="v / (μ d)")
    axes.legend(frameon=False, fontsize=8)
    return figure


def draw_steps(results):
    """Errors over steps: one law has none."""
    figure, axes = canvas()
    for law, label in (*LABELS.items(), ("slider", "slider")):
        if law in results["steps"]:
            errors = np.maximum(results["steps"][law], 1e-17)
            axes.loglog(results["steps"]["steps"], errors, "o-", ms=3, label=label)
    axes.set(xlabel="steps of a leg", ylabel="largest error of T / μN", ylim=(1e-17, 30))
    axes.legend(frameon=False, fontsize=6.5, loc="center right")
    return figure


def draw_sizes(results):
    """Time of an event over the number of asperities."""
    figure, axes = canvas()
    axes.loglog(results["sizes"]["sizes"], results["sizes"]["microseconds"], "o-")
    axes.set(xlabel="asperities", ylabel="time of an event / µs", ylim=(1, 1e3))
    return figure


def draw_circle(_):
    """Error of the tangential load along a circle."""
    name = "19_circle_07"
    case, columns = score.read_case(name)
    figure, axes = canvas()
    for code in ("vector_springs", "historysim"):
        found = score.read_csv(CODES / code / f"{name}.csv")
        error = np.hypot(found["Tx"] - columns["Tx"], found["Ty"] - columns["Ty"])
        angle = 15 * (columns["t"] - 1)
        axes.plot(angle[1:], (error / case["units"]["Tx"])[1:], "o-", ms=3, label=LABELS[code])
    axes.set(xlabel="angle along the circle / °", ylabel="error of T / μN", ylim=(0, None))
    axes.legend(frameon=False, fontsize=8)
    return figure


def draw_codes(results):
    """Errors of T of each code on each case."""
    figure, axes = canvas(7.0, 3.2)
    names = score.list_cases()
    for code, marker in zip(LABELS, "os^x", strict=True):
        loads = [results["codes"][code]["loads"][name] for name in names]
        at = [number for number, error in enumerate(loads) if error is not None]
        errors = [max(error, 1e-16) for error in loads if error is not None]
        axes.semilogy(at, errors, marker, ms=4, mfc="none", label=LABELS[code])
    axes.set_xticks(range(len(names)), [name[:2] for name in names], fontsize=6)
    axes.set(xlabel="case", ylabel="largest error of T / μN", ylim=(1e-17, 2))
    axes.legend(frameon=False, fontsize=7, loc="center left")
    return figure


FIGURES = {
    "paper_memory": draw_memory,
    "paper_steps": draw_steps,
    "paper_sizes": draw_sizes,
    "paper_circle": draw_circle,
    "paper_codes": draw_codes,
}


# -- the page --------------------------------------------------------------------------------------


def list_values(results):
    """Text of every number of the page by name."""
    steps, sizes, codes = results["steps"], results["sizes"], results["codes"]
    values = {"cases": f"{len(score.list_cases())}"}
    for law in ("vector_springs", "mindlin_deresiewicz", "slider"):
        values[f"{law}_one"] = f"{steps[law][0]:.1g}"
        values[f"{law}_many"] = f"{steps[law][-1]:.1g}"
    values["exact_error"] = f"{max(steps['historysim']):.0e}"
    values["most_steps"] = f"{steps['steps'][-1]:,}"
    values["fewest"], values["most"] = f"{sizes['sizes'][0]:,}", f"{sizes['sizes'][-1]:,}"
    values["time_fewest"] = f"{sizes['microseconds'][0]:.2g}"
    values["time_most"] = f"{sizes['microseconds'][-1]:.2g}"
    circle, spiral, dither = "19_circle_07", "20_spiral", "11_steep_impact"
    for code, each in codes.items():
        for key in ("mean", "exact", "failures"):
            values[f"{code}_{key}"] = f"{each[key]:.2g}"
        for short, name in (("circle", circle), ("spiral", spiral), ("impact", dither)):
            for kind in ("loads", "energy"):
                error = each[kind][name]
                values[f"{code}_{short}_{kind}"] = "–" if error is None else f"{error:.1g}"
    plane = {
        name: error
        for name, error in codes["historysim"]["loads"].items()
        if error is not None and "Tx" in score.read_case(name)[0]["expected"]
    }
    neglected = plane.pop("32_poisson_03")
    values["plane_error"], values["poisson_error"] = (
        f"{max(plane.values()):.1g}",
        f"{neglected:.1g}",
    )
    line = [
        error
        for name, error in codes["historysim"]["loads"].items()
        if error is not None and name not in plane and name != "32_poisson_03"
    ]
    values["line_error"] = f"{max(line):.0e}"
    return values


def write_page(results):
    """Fill the numbers into the text."""
    text = TEXT.read_text(encoding="utf-8").format_map(list_values(results))
    return "\n\n".join(map(wrap, text.split("\n\n")))


def wrap(block):
    """Break the lines of a paragraph anew; tables, code, lists, headings and pictures stay."""
    if block.startswith(("#", "|", "    ", "```", "!", "- ")):
        return block
    end = "\n" if block.endswith("\n") else ""
    return textwrap.fill(block, 98, break_long_words=False, break_on_hyphens=False) + end


def main():
    """Measure if asked, and write page and figures."""
    if "--measure" in sys.argv:
        RESULTS.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for name, draw in FIGURES.items():
        draw(results).savefig(PICTURES / f"{name}.png", dpi=150, metadata={"Software": None})
    PAGE.write_text(write_page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
