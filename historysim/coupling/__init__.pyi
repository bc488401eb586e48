# The public names, each with the place where it stands.

from historysim.coupling.control_system import contact_system as contact_system
from historysim.coupling.integration import CoupledSolution as CoupledSolution
from historysim.coupling.integration import solve_ivp as solve_ivp
from historysim.coupling.sampled_stage import StageMotion as StageMotion
from historysim.coupling.sampled_stage import controlled_stage as controlled_stage
