"""The numbers of an airframe that predict logged segments best: robust least squares on what its kernels predict.

Unknown besides the airframe's numbers are, of each flight: the mean wind, which way the thrust leans from the body's
axis, and the angular acceleration of what is not in balance. They are no numbers of the airframe, and are not kept.
Gauss-Newton with halved steps on Huber's loss; derivatives are differences of candidates that are predicted side by
side. Left out: gusts, errors of the logged state that last (a lean of the attitude counts as one of the thrust).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.airframes.multirotor import MultirotorAirframe
from sim.bodies.fit.numbers import FittedNumber, bounds_of, value_of, with_numbers
from sim.bodies.fit.prediction import Predictor
from sim.bodies.fit.segments import LEAD_TICKS, SEGMENT_S, WINDOW_S, Segments

KNOWN_STD = 0.25  # a number that is known worse than to a quarter stays as it was (guess)
_PRIOR_STD = 1.0  # of each number's unknown: a factor of e (guess)
_UNTOLD_STD = 0.7  # this and worse are told by next to nothing but that (guess)
_WIND_STD_M_S, _LEAN_STD_M_S2, _TRIM_STD_RAD_S2 = 5.0, 0.5, 5.0  # guesses
_WINDS, _LEANS, _TRIMS = slice(0, 2), slice(2, 4), slice(4, 7)
_OF_A_FLIGHT = 7
_STEP, _WIND_STEP_M_S = 0.03, 0.3  # of differences
_HUBER = 2.5  # deviations
_LEAST_STD = 0.005  # [m/s], [rad/s] of an error: a log is not more exact
_ROUNDS, _STEPS, _HALVINGS = 4, 4, 5
_LEAST_GAIN, _LEAST_MOVE = 1e-4, 1e-3  # of the loss, of an unknown: less is the end


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Predicted less logged, of segments."""

    vel_ned: NDArray[Any]  # (segments, 3) [m/s] at the end
    omega_frd: NDArray[Any]  # (segments, WINDOWS, 3) [rad/s] at the windows' ends

    def rms(self) -> tuple[float, float]:
        """Root mean squares of the lengths of both [m/s], [rad/s]."""
        both = (np.sqrt(np.square(each).sum(axis=-1).mean()) for each in (self.vel_ned, self.omega_frd))
        return float(next(both)), float(next(both))

    def flat(self) -> NDArray[Any]:
        """One row per segment."""
        return np.concatenate([self.vel_ned, self.omega_frd.reshape(len(self.vel_ned), -1)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What came of it."""

    airframe: MultirotorAirframe
    stds: dict[FittedNumber, float]  # of the unknowns that are known; of the others there is none
    unknown: dict[FittedNumber, float]  # those that stay, and how well they would be known
    flights: NDArray[Any]  # (logs, 7) wind north, east [m/s]; lean x, y [m/s²]; trim p, q, r [rad/s²]


def fit_flights(airframe: MultirotorAirframe, segments: Segments) -> Fit:
    """What flights are like if the airframe is right: only their winds, leans and trims are fitted."""
    return fit_airframe(airframe, segments, ())


def fit_airframe(airframe: MultirotorAirframe, segments: Segments, numbers: Sequence[FittedNumber]) -> Fit:
    """Fits an airframe's numbers to segments; those that these do not tell stay as they are.

    Of several that are told badly the worst is left out first: the others may be told well without it.
    """
    flights = np.zeros((segments.log_count, _OF_A_FLIGHT))
    stds: dict[FittedNumber, float] = {}
    unknown: dict[FittedNumber, float] = {}
    for by_rates in (False, True):
        solver = _Solver(airframe, segments, flights, by_rates=by_rates)
        chosen = [each for each in numbers if each.by_rates == by_rates]
        unknown |= {each: float("inf") for each in chosen if _is_nothing(airframe, each)}
        while True:
            chosen = [each for each in chosen if each not in unknown]
            fit = solver.solved(chosen)
            worst = max(fit.stds.values(), default=0.0)
            if worst <= KNOWN_STD:
                break
            unknown |= {each: std for each, std in fit.stds.items() if std >= min(worst, _UNTOLD_STD)}
        airframe, flights = fit.airframe, fit.flights
        stds |= fit.stds
    return Fit(airframe, stds, unknown, flights)


def _is_nothing(airframe: MultirotorAirframe, number: FittedNumber) -> bool:
    """Whether there is nothing that a factor could change."""
    return number.is_factor and value_of(airframe, number) == 0.0


def errors_of(airframe: MultirotorAirframe, segments: Segments, flights: NDArray[Any]) -> Errors:
    """How far an airframe's predictions are off, in flights of these winds, leans and trims."""
    predicted = Predictor(segments).predict([airframe], flights[None, :, _WINDS])
    return _Linear(segments).errors(predicted[0][0], predicted[1][0], flights)


class _Linear:
    """What leans and trims add to predictions."""

    def __init__(self, segments: Segments) -> None:
        self._log = segments.log
        self._vel_ned, self._omega_frd = segments.flown
        x, y, z, w = np.moveaxis(segments.q_ned_from_frd[:, LEAD_TICKS:-1].astype(float), -1, 0)
        ahead = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)
        right = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=-1)
        self.leaned = SEGMENT_S * np.stack([ahead.mean(axis=1), right.mean(axis=1)], axis=-1)  # (segments, 3, 2)

    def errors(self, vel_ned: NDArray[Any], omega_frd: NDArray[Any], flights: NDArray[Any]) -> Errors:
        """Of predictions with these leans and trims."""
        mine = flights[self._log]
        leant = np.einsum("sij,sj->si", self.leaned, mine[:, _LEANS])
        turned = WINDOW_S * mine[:, None, _TRIMS]
        return Errors(vel_ned + leant - self._vel_ned, omega_frd + turned - self._omega_frd)


class _Solver:
    """Gauss-Newton on one set of segments, from their velocities or from their rates."""

    def __init__(
        self, airframe: MultirotorAirframe, segments: Segments, flights: NDArray[Any], *, by_rates: bool
    ) -> None:
        self._start, self._segments, self._by_rates = airframe, segments, by_rates
        self._predictor, self._linear = Predictor(segments), _Linear(segments)
        self._start_flights, self._logs = flights, segments.log_count
        self._columns = slice(3, None) if by_rates else slice(0, 3)
        self._asked = np.arange(4, 7) if by_rates else np.arange(4)  # of a flight's unknowns

    def solved(self, numbers: Sequence[FittedNumber]) -> Fit:
        count = len(numbers)
        x = np.concatenate([np.zeros(count), self._start_flights[:, self._asked].ravel()])
        precision = self._precisions(count)
        errors = self._errors(x, numbers)
        for i_round in range(_ROUNDS):
            spread = _spread(errors, counts_all=i_round == 0)
            before = x
            for _ in range(_STEPS):
                x, errors, gain = self._step(x, errors, spread, precision, numbers)
                if gain < _LEAST_GAIN:
                    break
            if i_round > 0 and np.abs(x - before).max(initial=0.0) < _LEAST_MOVE:
                break
        std = _uncertainty(self._jacobian(x, numbers) / spread, errors / spread, precision)[:count]
        for k, number in enumerate(numbers):
            if number.is_factor and x[k] in bounds_of(self._start, number):
                std[k] = np.inf  # no end of it was found
        known = dict(zip(numbers, std.tolist(), strict=True))
        return Fit(self._candidate(x, numbers), known, {}, self._flights(x, count))

    def _precisions(self, count: int) -> NDArray[Any]:
        flight = np.repeat([_WIND_STD_M_S, _LEAN_STD_M_S2, _TRIM_STD_RAD_S2], [2, 2, 3])[self._asked]
        return np.asarray(np.concatenate([np.full(count, _PRIOR_STD), np.tile(flight, self._logs)]) ** -2.0)

    def _flights(self, x: NDArray[Any], count: int) -> NDArray[Any]:
        flights = self._start_flights.copy()
        flights[:, self._asked] = x[count:].reshape(self._logs, -1)
        return flights

    def _candidate(self, x: NDArray[Any], numbers: Sequence[FittedNumber]) -> MultirotorAirframe:
        return with_numbers(self._start, dict(zip(numbers, x, strict=False)))

    def _errors(self, x: NDArray[Any], numbers: Sequence[FittedNumber]) -> NDArray[Any]:
        flights = self._flights(x, len(numbers))
        predicted = self._predictor.predict([self._candidate(x, numbers)], flights[None, :, _WINDS])
        return self._linear.errors(predicted[0][0], predicted[1][0], flights).flat()[:, self._columns]

    def _jacobian(self, x: NDArray[Any], numbers: Sequence[FittedNumber]) -> NDArray[Any]:
        """Change of each error with each unknown, shape (segments, errors, unknowns)."""
        count = len(numbers)
        steps = np.array([self._step_of(x[k], number) for k, number in enumerate(numbers)] + [_WIND_STEP_M_S] * 2)
        airframes = [self._candidate(x, numbers)] * (count + 3)
        winds = np.repeat(self._flights(x, count)[None, :, _WINDS], count + 3, axis=0)
        for k in range(count):
            moved = x.copy()
            moved[k] += steps[k]
            airframes[k] = self._candidate(moved, numbers)
        for axis in range(2):
            winds[count + axis, :, axis] += _WIND_STEP_M_S
        vel_ned, omega_frd = self._predictor.predict(airframes, winds)
        flat = np.concatenate([vel_ned, omega_frd.reshape(*vel_ned.shape[:2], -1)], axis=2)[..., self._columns]
        changes = np.moveaxis((flat[:-1] - flat[-1]) / steps[:, None, None], 0, -1)
        jacobian = np.zeros((*flat.shape[1:], len(x)))
        jacobian[..., :count] = changes[..., :count]
        for i_log in range(self._logs):
            mine, at = self._segments.log == i_log, count + len(self._asked) * i_log
            if self._by_rates:
                for axis in range(3):
                    jacobian[mine, axis::3, at + axis] = WINDOW_S
            else:
                jacobian[mine, :, at : at + 2] = changes[mine, :, count:]
                jacobian[mine, :, at + 2 : at + 4] = self._linear.leaned[mine]
        return jacobian

    def _step_of(self, unknown: float, number: FittedNumber) -> float:
        """A difference that stays within the bounds."""
        return _STEP if unknown + _STEP <= bounds_of(self._start, number)[1] else -_STEP

    def _step(
        self,
        x: NDArray[Any],
        errors: NDArray[Any],
        spread: float,
        precision: NDArray[Any],
        numbers: Sequence[FittedNumber],
    ) -> tuple[NDArray[Any], NDArray[Any], float]:
        """A step downhill, halved until it is one; and by which fraction the loss has fallen."""
        scaled = errors / spread
        weight = _weights(scaled)
        jacobian = self._jacobian(x, numbers) / spread
        hessian = np.einsum("sdi,sd,sdj->ij", jacobian, weight, jacobian) + np.diag(precision)
        gradient = np.einsum("sdi,sd,sd->i", jacobian, weight, scaled) + precision * x
        step = self._downhill(hessian, gradient, x, numbers)
        loss = _loss(scaled, x, precision)
        for _ in range(_HALVINGS):
            moved = x + step
            found = self._errors(moved, numbers)
            after = _loss(found / spread, moved, precision)
            if after < loss:
                return moved, found, (loss - after) / loss
            step = 0.5 * step
        return x, errors, 0.0

    def _downhill(
        self, hessian: NDArray[Any], gradient: NDArray[Any], x: NDArray[Any], numbers: Sequence[FittedNumber]
    ) -> NDArray[Any]:
        """The step to the least of the quadratic within the numbers' bounds: those that would leave stop at theirs."""
        low, high = np.full(len(x), -np.inf), np.full(len(x), np.inf)
        for k, number in enumerate(numbers):
            low[k], high[k] = bounds_of(self._start, number)
        step, is_free = np.zeros(len(x)), np.ones(len(x), np.bool_)
        for _ in range(len(numbers) + 1):
            pull = gradient[is_free] + hessian[np.ix_(is_free, ~is_free)] @ step[~is_free]
            step[is_free] = -np.linalg.solve(hessian[np.ix_(is_free, is_free)], pull)
            leaves = is_free & ((x + step < low) | (x + step > high))
            if not leaves.any():
                break
            step[leaves] = np.clip(x + step, low, high)[leaves] - x[leaves]
            is_free &= ~leaves
        return step


def _spread(errors: NDArray[Any], *, counts_all: bool) -> float:
    """Standard deviation of errors of all axes: of all of them, or from the median, for which outliers do not count.

    One for all axes: of an own one, an axis that is far off at first would weigh next to nothing, and stay so.
    """
    size = np.abs(errors)
    return max(float(np.sqrt(np.mean(size * size)) if counts_all else 1.4826 * np.median(size)), _LEAST_STD)


def _weights(scaled: NDArray[Any]) -> NDArray[Any]:
    """Huber's."""
    return np.asarray(np.minimum(1.0, _HUBER / np.maximum(np.abs(scaled), 1e-12)))


def _loss(scaled: NDArray[Any], x: NDArray[Any], precision: NDArray[Any]) -> float:
    size = np.abs(scaled)
    huber = np.where(size <= _HUBER, 0.5 * size * size, _HUBER * (size - 0.5 * _HUBER))
    loss = float(huber.sum() + 0.5 * (precision * x * x).sum())
    return loss if np.isfinite(loss) else float("inf")


def _uncertainty(jacobian: NDArray[Any], scaled: NDArray[Any], precision: NDArray[Any]) -> NDArray[Any]:
    """Standard deviations of the unknowns: the greater of two estimates.

    One takes all errors as independent, the other only segments (the sandwich of M-estimators: P. J. Huber, "Robust
    Statistics", 1981): errors of one segment go together. `jacobian` and `scaled` are in deviations of the errors.
    """
    weight = _weights(scaled)
    hessian = np.einsum("sdi,sd,sdj->ij", jacobian, weight, jacobian) + np.diag(precision)
    inverse = np.linalg.inv(hessian)
    pulls = np.einsum("sdi,sd,sd->si", jacobian, weight, scaled)
    sandwich = inverse @ (pulls.T @ pulls + np.diag(precision)) @ inverse
    return np.sqrt(np.maximum(np.diag(inverse), np.diag(sandwich)))
