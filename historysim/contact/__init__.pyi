# One contact without memory: materials and closed forms, each with the module that defines it.

from historysim.contact import adhesion as adhesion
from historysim.contact import drift as drift
from historysim.contact import hertz as hertz
from historysim.contact import mindlin as mindlin
from historysim.contact import subsurface as subsurface
from historysim.contact.greenwood_williamson import GreenwoodWilliamson as GreenwoodWilliamson
from historysim.contact.materials import Material as Material
from historysim.contact.materials import MaterialPair as MaterialPair
from historysim.contact.materials import material as material
from historysim.contact.subsurface import largest_principal as largest_principal
from historysim.contact.subsurface import von_mises as von_mises
