"""`honeyguide world`: a world file checked, told, and exported."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from mission.console.command_refusal import refuse
from mission.console.name_checks import check_file
from mission.console.terminal import loading


def world(
    file: Annotated[Path, typer.Argument(help="A world file (docs/how-to/worlds.md).")],
    export: Annotated[
        Path | None, typer.Option(help="Writes it as glTF (.glb), or its ground as a heightmap (.png) with its scale.")
    ] = None,
) -> None:
    """Check a world file, say what is in it, and export it."""
    from mission.console.option_checks import UserError

    check_file(file)
    console = Console()
    try:
        with loading(console):
            from mission.world.world_reader import read_and_build

            config, made = read_and_build(file)
        counts = [
            f"{len(items)} {name}"
            for name, items in (
                ("boxes", config.boxes), ("walls", config.walls), ("cylinders", config.cylinders),
                ("meshes", config.meshes), ("pads", config.pads), ("trees", made.trees),
            )
            if len(items)
        ]  # fmt: skip
        low, high = float(made.heights.min()), float(made.heights.max())
        ground = f"ground of {made.config.size_m:g} m from {low:.1f} to {high:.1f} m"
        triangles = f"{len(made.solids.faces)} triangles"
        console.print(f"{file}: {', '.join([ground, *counts, triangles])}", markup=False, soft_wrap=True)
        if export is not None:
            if find_spec("trimesh") is None:
                refuse("--export needs the extra 'worlds': pip install 'honeyguide[worlds]' brings trimesh")
            from mission.world.world_export import export_world

            export_world(made, export)
            console.print(f"written: {export}", markup=False, soft_wrap=True)
    except UserError as error:
        refuse(str(error))
