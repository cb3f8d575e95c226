"""Derives the filter's Jacobians symbolically and writes them as Warp code: `python -m autopilot.estimator.derive`.

Role: offline; a test runs it and compares the text with the committed `generated.py`. In: the motion and observation
models below, as sympy expressions of the error state. Out: the covariance prediction with the zeros of its transition
matrix left out, and for each observation the two products that a scalar fusion needs.

The error state is additive except for the attitude, whose error is a small rotation in ned:
`R_true = (I + [att]x) R`. Then (Solà 2017, "Quaternion kinematics for the error-state Kalman filter", section 7, global
angular error) its rate is -R gyro_bias, and that of the velocity -[R f]x att - R accel_bias.
"""

from pathlib import Path

import sympy as sp
from sympy.printing.str import StrPrinter

GENERATED_PATH = Path(__file__).with_name("generated.py")

BLOCKS = {"att": 3, "vel": 3, "pos": 3, "gyro_bias": 3, "accel_bias": 3, "earth": 3, "body": 3, "wind": 2, "terrain": 1}
COUNT = sum(BLOCKS.values())
MOVING = 9  # attitude, velocity and position: the only errors that others flow into
SLOW_COUNT = 4  # slow errors of sensors; their covariances with the error state stand in rows COUNT + j

HEADER = '''"""Covariance prediction and observation products. Written by autopilot/estimator/derive.py: do not edit."""

import warp as wp

from common.kernels import vec24

wp.set_module_options({"enable_backward": False})
'''


class _FloatPrinter(StrPrinter):
    """Prints expressions whose numbers are all floats, as Warp's typing wants, and small powers as products."""

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Rational(self, expr: sp.Rational) -> str:
        return f"{float(expr)}"

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        if expr.exp == 2:
            base = self.parenthesize(expr.base, 60)
            return f"({base}*{base})"
        return str(super()._print_Pow(expr, rational))

    def _print_Abs(self, expr: sp.Abs) -> str:
        return f"wp.abs({self._print(expr.args[0])})"


def _code(expr: sp.Expr) -> str:
    return str(_FloatPrinter().doprint(expr)).replace("*", " * ").replace("/", " / ")


def _skew(vector: sp.Matrix) -> sp.Matrix:
    x, y, z = vector
    return sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _vector(prefix: str) -> sp.Matrix:
    return sp.Matrix([sp.Symbol(f"{prefix}[{axis}]", real=True) for axis in range(3)])


def error_symbols() -> dict[str, sp.Matrix]:
    """One column of symbols per block of the error state, in the order of the covariance."""
    return {
        name: sp.Matrix([sp.Symbol(f"d_{name}_{axis}", real=True) for axis in range(size)])
        for name, size in BLOCKS.items()
    }


def _stacked(errors: dict[str, sp.Matrix]) -> sp.Matrix:
    return sp.Matrix.vstack(*errors.values())


def _at_zero(expr: sp.Matrix, errors: sp.Matrix) -> sp.Matrix:
    return expr.subs(dict.fromkeys(errors, 0))


def attitude_error_rate(gyro_bias_error: sp.Matrix) -> sp.Matrix:
    """Rate of the attitude error, from the kinematics of two rotations whose rates differ by the bias error.

    d/dt(R_true R') = R_true [omega_true - omega]x R'; at zero error its axial vector is R (omega_true - omega). The
    rotation is written with a quaternion so that its orthogonality holds by itself.
    """
    w, x, y, z = sp.symbols("w x y z", real=True)
    rotation = sp.Matrix(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    product = rotation * _skew(-gyro_bias_error) * rotation.T
    axial = sp.Matrix([product[2, 1], product[0, 2], product[1, 0]])
    norm_sq = w * w + x * x + y * y + z * z
    entries = sp.Matrix([[sp.Symbol(f"rot[{row}, {column}]") for column in range(3)] for row in range(3)])
    rate = sp.zeros(3, 1)
    for row in range(3):
        for column in range(3):
            coefficient = sp.diff(axial[row], gyro_bias_error[column])
            # |q|² = 1: the coefficient is homogeneous of degree 4, minus the rotation's entry times |q|².
            if sp.expand(coefficient + rotation[row, column] * norm_sq) != 0:
                raise AssertionError("the attitude error rate is not -R gyro_bias")
            rate[row] -= entries[row, column] * gyro_bias_error[column]
    return rate


def transition() -> sp.Matrix:
    """Transition matrix of the error state over one covariance step, first order in the step."""
    errors = error_symbols()
    dt_s = sp.Symbol("dt_s")
    rotation = sp.Matrix([[sp.Symbol(f"rot[{row}, {column}]") for column in range(3)] for row in range(3)])
    delta_vel_ned = _vector("delta_vel_ned")
    turned = (sp.eye(3) + _skew(errors["att"])) * delta_vel_ned - delta_vel_ned
    after = dict(errors)
    after["att"] = errors["att"] + attitude_error_rate(errors["gyro_bias"]) * dt_s
    after["vel"] = errors["vel"] + turned - rotation * errors["accel_bias"] * dt_s
    after["pos"] = errors["pos"] + errors["vel"] * dt_s
    return _stacked(after).jacobian(_stacked(errors))


def _turned_axis(errors: dict[str, sp.Matrix]) -> sp.Matrix:
    """A body axis in ned under the attitude error."""
    axis = _vector("axis_ned")
    return axis + _skew(errors["att"]) * axis


def observations() -> dict[str, tuple[str, str, sp.Expr, str]]:
    """Name to (arguments, meaning, expression of the error state, block whose row `i_axis` picks).

    An observation along a body axis is derived for that axis' direction in ned, so that one function serves x, y, z.
    """
    errors = error_symbols()
    axis = _turned_axis(errors)
    picked = sp.Symbol("picked")  # the error of the component i_axis of the block named last
    earth = _vector("earth_field_ned") + errors["earth"]
    wind = sp.Matrix([errors["wind"][0], errors["wind"][1], 0])
    airspeed = axis.dot(_vector("vel_air_ned") + errors["vel"] - wind)
    linear, square = sp.symbols("linear square", real=True)
    # |u| u differentiated at u: 2 |u|; written with the nominal speed so that no derivative of |u| appears.
    speed_abs, speed = sp.symbols("speed_abs speed", real=True)
    drag = -(linear * airspeed + square * (2 * speed_abs * (airspeed - speed) + speed_abs * speed)) + picked
    height = sp.Symbol("height") + errors["terrain"][0] - errors["pos"][2]
    down = _turned_axis(errors)[2]
    axis_args = "axis_ned: wp.vec3, i_axis: int"
    return {
        "mag": (
            f"{axis_args}, earth_field_ned: wp.vec3",
            "magnetic field along a body axis: axis . earth + body field",
            axis.dot(earth) + picked,
            "body",
        ),
        "drag": (
            f"{axis_args}, vel_air_ned: wp.vec3, linear: float, square: float, speed_abs: float",
            "drag along a body axis: -(linear u + square |u| u) + bias, u = axis . (velocity - wind)",
            drag,
            "accel_bias",
        ),
        "range": (
            "axis_ned: wp.vec3, height: float",
            "distance along body down: (terrain - position) / axis_d",
            height / down,
            "",
        ),
        "speed": (
            "axis_ned: wp.vec3, vel_ned: wp.vec3",
            "speed over ground along a body axis: axis . velocity",
            axis.dot(_vector("vel_ned") + errors["vel"]),
            "",
        ),
    }


def jacobian(name: str) -> tuple[dict[int, sp.Expr], int]:
    """Non-zero entries of an observation's row by state index, and the base index of its picked row (-1: none)."""
    errors = _stacked(error_symbols())
    _, _, expression, picked_block = observations()[name]
    row = _at_zero(sp.Matrix([expression]).jacobian(errors), errors)
    entries = {index: sp.simplify(entry) for index, entry in enumerate(row) if sp.simplify(entry) != 0}
    starts = dict(zip(BLOCKS, [sum(list(BLOCKS.values())[:k]) for k in range(len(BLOCKS))], strict=True))
    return entries, starts[picked_block] if picked_block else -1


def observation_code(name: str) -> list[str]:
    """Lines of the function that returns P H' and H P H' of one observation."""
    arguments, meaning, _, _ = observations()[name]
    entries, base = jacobian(name)
    shared, reduced = sp.cse(list(entries.values()), symbols=sp.numbered_symbols("t"))
    lines = [
        "",
        "",
        "@wp.func",
        f"def {name}_products(",
        *[f"    {argument}," for argument in f"cov: wp.array2d(dtype=vec24), i: int, {arguments}".split(", ")],
        ") -> tuple[vec24, wp.vec4, float]:",
        f'    """P H\' (of the error state and of the slow errors) and H P H\' of the {meaning}."""',
    ]
    lines += [f"    {symbol} = {_code(value)}" for symbol, value in shared]
    lines += [f"    h{index} = {_code(value)}" for index, value in zip(entries, reduced, strict=True)]
    terms = [f"h{index} * cov[i, {index}]" for index in entries]
    sums = [f"h{index} * ph[{index}]" for index in entries]
    if base >= 0:
        terms.append(f"cov[i, {base} + i_axis]")
        sums.append(f"ph[{base} + i_axis]")
    lines.append(f"    ph = {terms[0]}")
    lines += [f"    ph = ph + {term}" for term in terms[1:]]
    lines.append(f"    hph = {sums[0]}")
    lines += [f"    hph = hph + {term}" for term in sums[1:]]
    for slow in range(SLOW_COUNT):
        lines.append(f"    c{slow} = cov[i, {COUNT + slow}]")
        products = [f"h{index} * c{slow}[{index}]" for index in entries]
        if base >= 0:
            products.append(f"c{slow}[{base} + i_axis]")
        lines.append(f"    s{slow} = {products[0]}")
        lines += [f"    s{slow} = s{slow} + {product}" for product in products[1:]]
    slows = ", ".join(f"s{slow}" for slow in range(SLOW_COUNT))
    lines.append(f"    return ph, wp.vec4({slows}), hph")
    return lines


def _row_code(row: int, entries: dict[int, str]) -> str:
    others = " + ".join(f"{name} * p{column}" for column, name in entries.items())
    return f"    a{row} = p{row} + {others}"


def prediction_code() -> list[str]:
    """Lines of F P F' + Q: whole rows for F P, then one triangle of the moving block, mirrored."""
    matrix = transition() - sp.eye(COUNT)
    if any(matrix[row, column] != 0 for row in range(MOVING, COUNT) for column in range(COUNT)):
        raise AssertionError("an error outside the moving block changes")
    cells = {(r, c): matrix[r, c] for r in range(MOVING) for c in range(COUNT) if matrix[r, c] != 0}
    names: dict[sp.Expr, str] = {sp.Symbol("dt_s"): "dt_s"}
    lines = [
        "",
        "",
        "@wp.func",
        "def predict_covariance(",
        "    cov: wp.array2d(dtype=vec24), "
        "i: int, rot: wp.mat33, delta_vel_ned: wp.vec3, dt_s: float, added_var: vec24",
        ") -> None:",
        '    """P = F P F\' + diag(added_var) over one step; rows from 9 on of F are those of the identity."""',
    ]
    for value in cells.values():
        if value not in names:
            names[value] = f"f{len(names)}"
            lines.append(f"    {names[value]} = {_code(value)}")
    factors = {row: {c: names[v] for (r, c), v in cells.items() if r == row} for row in range(MOVING)}
    used = max(c for _, c in cells) + 1
    lines += [f"    p{row} = cov[i, {row}]" for row in range(used)]
    lines += [_row_code(row, factors[row]) for row in range(MOVING)]
    for row in range(MOVING):
        for column in range(row, MOVING):
            terms = " + ".join(f"{name} * a{row}[{k}]" for k, name in factors[column].items())
            noise = f" + added_var[{row}]" if row == column else ""
            lines.append(f"    n{row}_{column} = a{row}[{column}] + {terms}{noise}")
    for row in range(MOVING):
        for column in range(MOVING):
            lines.append(f"    a{row}[{column}] = n{min(row, column)}_{max(row, column)}")
        lines.append(f"    cov[i, {row}] = a{row}")
    for row in range(MOVING, COUNT):
        lines.append(f"    b{row} = cov[i, {row}]")
        lines += [f"    b{row}[{column}] = a{column}[{row}]" for column in range(MOVING)]
        lines.append(f"    b{row}[{row}] = b{row}[{row}] + added_var[{row}]")
        lines.append(f"    cov[i, {row}] = b{row}")
    lines.append(f"    for j in range({SLOW_COUNT}):")
    lines.append(f"        c = cov[i, {COUNT} + j]")
    for row in range(MOVING):
        terms = " + ".join(f"{name} * c[{column}]" for column, name in factors[row].items())
        lines.append(f"        c{row} = c[{row}] + {terms}")
    lines += [f"        c[{row}] = c{row}" for row in range(MOVING)]
    lines.append(f"        cov[i, {COUNT} + j] = c")
    return lines


def generate() -> str:
    """The whole text of generated.py."""
    lines = prediction_code()
    for name in observations():
        lines += observation_code(name)
    return HEADER + "\n".join(lines) + "\n"


if __name__ == "__main__":
    GENERATED_PATH.write_text(generate(), encoding="utf-8")
