"""Measured records from elsewhere that tests may use where they are; they are no part of the repository."""

import os
from pathlib import Path

SHARED = Path(os.environ.get("HISTORYSIM_RECORDS", Path(__file__).parents[3] / "shared" / "data"))
DAMPER = SHARED / "friction_damper" / "0.5Hz36lbtension1amplitude.json"
DAMPER_SCENARIO = f"""
title = "Banded rotary friction device"
[materials]
contact_modulus = "100 GPa"
shear_modulus = "20 GPa"
[surface]
kind = "sphere"
radius = "1 m"
[friction]
coefficient = 15
[loading]
file = "{DAMPER.as_posix()}"
reduce = true
[loading.columns]
time = {{ column = "data", index = 1 }}
normal_load = {{ constant = "1 kN" }}
tangential_displacement = {{ column = "data", index = 2, unit = "in", centred = true }}
[loading.response]
tangential_load = {{ column = "data", index = 3, unit = "kip" }}
[loading.dead_band]
tangential_displacement = "1 mm"
[instrument]
lateral_stiffness = "3 kN/mm"
[fit]
parameters = ["friction", "lateral_stiffness"]
"""
