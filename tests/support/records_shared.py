"""Measured records from elsewhere that tests may use where they are; they are no part of the repository."""

import os
from pathlib import Path

SHARED = Path(os.environ.get("HISTORYSIM_RECORDS", Path(__file__).parents[3] / "shared" / "data"))
DAMPER = SHARED / "friction_damper" / "0.5Hz36lbtension1amplitude.json"
GRANITE = SHARED / "triaxial" / "TM11_Pc130_Pp50_T100_loading.tsv"
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
GRANITE_SCENARIO = f"""
title = "Direct shear of granite"
[materials]
first = {{ name = "granite", youngs_modulus = "60 GPa", poissons_ratio = 0.25 }}
second = {{ name = "granite", youngs_modulus = "60 GPa", poissons_ratio = 0.25 }}
[surface]
kind = "sphere"
radius = "1 m"
[friction]
coefficient = 0.2
[loading]
file = "{GRANITE.as_posix()}"
reduce = true
end = "8900 s"
[loading.columns]
time = {{ column = 1, unit = "s" }}
normal_load = {{ column = 4, unit = "MPa", area = "720 mm2" }}
tangential_displacement = {{ column = 8, unit = "mm", scale = -1, offset = "7.738 mm" }}
[loading.response]
tangential_load = {{ column = 6, unit = "kN" }}
[loading.dead_band]
tangential_displacement = "5 µm"
normal_load = "500 N"
[instrument]
lateral_stiffness = "100 kN/mm"
[fit]
parameters = ["friction", "lateral_stiffness"]
"""
