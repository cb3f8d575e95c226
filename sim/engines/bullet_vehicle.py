"""One vehicle's rigid body in Bullet: made, put somewhere, pushed, read, and asked what it touches."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.attitude import inverse, rotated
from sim.engines.bullet_body import Hull
from sim.engines.quiet_bullet import pybullet

_VEHICLES = 1 << 6  # group of collisions
_FLU = np.array([1.0, -1.0, -1.0])  # frd from flu, and ned from nwu


class BulletVehicle:
    """A body that moves.

    Args:
        client: of Bullet.
        hull: its solid part.
        model: row of the body's constants; of each class it has mass_kg and inertia_frd.
        damping: of linear and angular velocity [1/s].
        has_contacts: vehicles touch each other; otherwise they pass through each other.
    """

    def __init__(self, client: int, hull: Hull, model: Any, *, damping: float, has_contacts: bool) -> None:
        self._client, self._hull = client, hull
        self.body: int = pybullet.createMultiBody(float(model["mass_kg"]), hull.shape, physicsClientId=client)
        others = -1 if has_contacts else ~_VEHICLES
        pybullet.setCollisionFilterGroupMask(self.body, -1, _VEHICLES, others, physicsClientId=client)
        pybullet.changeDynamics(
            self.body,
            -1,
            localInertiaDiagonal=model["inertia_frd"].astype(float).tolist(),
            linearDamping=damping,
            angularDamping=damping,
            lateralFriction=hull.friction,
            restitution=0.0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=client,
        )

    def remove(self) -> None:
        """Contacts of before count for nothing in a body that is made anew."""
        pybullet.removeBody(self.body, physicsClientId=self._client)

    def put(self, row: Any) -> None:
        """Where and how its row of `BulletRow` has it."""
        body, client = self.body, self._client
        pos, q, vel, omega = (row[name].tolist() for name in ("pos", "q", "vel", "omega"))
        pybullet.resetBasePositionAndOrientation(body, pos, q, physicsClientId=client)
        pybullet.resetBaseVelocity(body, vel, omega, physicsClientId=client)

    def push(self, row: Any) -> None:
        """The force and torque of its row, in the next step."""
        body, client, frame = self.body, self._client, pybullet.LINK_FRAME
        pybullet.applyExternalForce(body, -1, row["force_flu"].tolist(), (0, 0, 0), frame, physicsClientId=client)
        pybullet.applyExternalTorque(body, -1, row["torque_flu"].tolist(), frame, physicsClientId=client)

    def read(self, row: Any) -> None:
        """Motion into its row."""
        row["pos"], row["q"] = pybullet.getBasePositionAndOrientation(self.body, physicsClientId=self._client)
        row["vel"], row["omega"] = pybullet.getBaseVelocity(self.body, physicsClientId=self._client)

    def touch(self, state: Any, motions: dict[int, Any], ground: int) -> None:
        """Feet that stand on something, impacts and strikes, into its `State` row.

        Args:
            state: live.
            motions: how each vehicle moved before the step, with pose, by its body.
            ground: the body of the terrain.
        """
        contacts = pybullet.getContactPoints(self.body, physicsClientId=self._client)
        if not contacts:
            return
        q, feet_m = state["q_ned_from_frd"].tolist(), self._hull.feet_from_m
        for contact in contacts:
            other, place, normal, force = contact[2], contact[5], contact[7], contact[9]  # this one is always the first
            if force <= 0.0:
                continue
            place_ned = _FLU * place
            arm_frd = rotated(inverse(q), (place_ned - state["pos_ned"]).tolist())
            is_foot = feet_m is not None and arm_frd[2] > feet_m
            towards_ned = _vel_at(motions[self.body], place_ned)
            if other in motions:
                towards_ned = towards_ned - _vel_at(motions[other], place_ned)
            closing = -float((_FLU * normal) @ towards_ned)
            state["impact_speed"] = max(float(state["impact_speed"]), closing)
            if is_foot:
                state["is_on_ground"] = 1
            is_strike = other == ground and feet_m is not None and not is_foot
            if is_strike or closing > self._hull.crash_m_s:
                state["is_crashed"] = 1


def _vel_at(motion: Any, place_ned: NDArray[Any]) -> NDArray[Any]:
    """The velocity of a point of a body [m/s], shape (3,)."""
    q = motion["q_ned_from_frd"].tolist()
    spin_ned = rotated(q, motion["omega_frd"].tolist())
    return np.asarray(motion["vel_ned"] + np.cross(spin_ned, place_ned - motion["pos_ned"]))
