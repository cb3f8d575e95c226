"""JSBSim, imported so that it prints nothing."""

import jsbsim

jsbsim.FGJSBBase().debug_lvl = 0  # type: ignore[no-untyped-call]

__all__ = ["jsbsim"]
