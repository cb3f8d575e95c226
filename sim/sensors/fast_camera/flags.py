"""Compiler options of the fast camera's hot modules.

An image may differ by a rounding from machine to machine; physics and estimation may not and never use these. Modules
with these options must not test for NaN or infinity: the compiler takes it that there are none.
"""

FAST: dict[str, bool | str] = {
    "enable_backward": False,
    "fast_math": True,  # CUDA only
    "cpu_compiler_flags": "-march=native -ffp-contract=fast -ffast-math -Wno-nan-infinity-disabled",
}
