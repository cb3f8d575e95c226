"""A rigid body in JSBSim that only forces from outside move: an aircraft file with a mass and nothing else.

JSBSim knows the forces of a step only after it has moved by those of the one before: each step it runs twice, first in
place so that it takes up the forces of now, then by the step.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from common.kernels import SUBSTEPS, TICK_S
from sim.engines.jsbsim_planet import MOTION, PLANET, put_at
from sim.engines.quiet_jsbsim import jsbsim

_EULER, _ADAMS_BASHFORTH_2 = 1, 3
_INTEGRATORS = {
    "rate/translational": _EULER,  # by forces that are those of mid-step already
    "rate/rotational": _EULER,
    "position/translational": _ADAMS_BASHFORTH_2,
    "position/rotational": _ADAMS_BASHFORTH_2,
}
_FORCES = [f"external_reactions/f{axis}/magnitude" for axis in "xyz"]
_FORCES += [f"external_reactions/m{axis}/magnitude-lbsft" for axis in "xyz"]
_DIRECTIONS = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
_AIRCRAFT = """<?xml version="1.0"?>
<fdm_config name="body" version="2.0" release="BETA">
  {planet}
  <metrics>
    <wingarea unit="M2">1</wingarea> <wingspan unit="M">1</wingspan> <chord unit="M">1</chord>
    <location name="AERORP" unit="M"> <x>0</x> <y>0</y> <z>0</z> </location>
  </metrics>
  <mass_balance>
    <ixx unit="KG*M2">{inertia[0]}</ixx> <iyy unit="KG*M2">{inertia[1]}</iyy> <izz unit="KG*M2">{inertia[2]}</izz>
    <emptywt unit="KG">{mass}</emptywt>
    <location name="CG" unit="M"> <x>0</x> <y>0</y> <z>0</z> </location>
  </mass_balance>
  <ground_reactions/> <propulsion/> <flight_control name="none"/>
  <aerodynamics> <axis name="LIFT"/> <axis name="ROLL"/> </aerodynamics>
  <external_reactions>{forces}</external_reactions>
</fdm_config>
"""
_FORCE = """
    <force name="f{axis}" frame="BODY">
      <location unit="M"> <x>0</x> <y>0</y> <z>0</z> </location>
      <direction> <x>{x}</x> <y>{y}</y> <z>{z}</z> </direction>
    </force>
    <moment name="m{axis}" frame="BODY"> <direction> <x>{x}</x> <y>{y}</y> <z>{z}</z> </direction> </moment>"""


class JsbsimBody:
    """One body.

    Args:
        model: its row of a body's `Model`: `mass_kg`, `inertia_frd`.
    """

    def __init__(self, model: Any) -> None:
        with TemporaryDirectory() as folder:
            file = Path(folder) / "aircraft" / "body" / "body.xml"
            file.parent.mkdir(parents=True)
            file.write_text(_aircraft(float(model["mass_kg"]), model["inertia_frd"].tolist()), encoding="utf-8")
            self._sim = jsbsim.FGFDMExec(folder)
            self._sim.load_model("body")
        self._sim.set_dt(TICK_S / SUBSTEPS)
        for name, integrator in _INTEGRATORS.items():
            self._sim[f"simulation/integrator/{name}"] = integrator
        properties: Any = self._sim.get_property_manager()
        self._forces = [properties.get_node(name) for name in _FORCES]
        self._motion = [properties.get_node(name) for name in MOTION]
        self._is_put = False  # somewhere else, since its last step

    def put(self, row: Any) -> tuple[float, float, float]:
        """Puts it where a row of `BodyState` has it; returns where JSBSim's north and east then count from [m]."""
        self._is_put = True
        return put_at(self._sim, row, 0.0)

    def moved(self, wrench: list[float]) -> list[float]:
        """Moves it by a millisecond.

        Args:
            wrench: force [lbf] and moment [lbf ft] along frd, 6.

        Returns:
            North, east, up from where it was put [ft], up over home; velocity ned [ft/s]; roll, pitch, yaw [rad];
            angular rate frd [rad/s].
        """
        sim = self._sim
        for force, value in zip(self._forces, wrench, strict=True):
            force.set_double_value(value)
        if self._is_put:
            sim.run_ic()  # with these forces, or the first step would know those of before
            self._is_put = False
        else:
            sim.suspend_integration()
            sim.run()  # in place: the step after it starts from the forces of now
            sim.resume_integration()
        sim.run()
        return [each.get_double_value() for each in self._motion]


def _aircraft(mass_kg: float, inertia_kg_m2: list[float]) -> str:
    """The file: inertia about forward, right and down [kg m²]."""
    forces = [_FORCE.format(axis=axis, x=x, y=y, z=z) for axis, (x, y, z) in _DIRECTIONS.items()]
    return _AIRCRAFT.format(planet=PLANET, inertia=inertia_kg_m2, mass=mass_kg, forces="".join(forces))
