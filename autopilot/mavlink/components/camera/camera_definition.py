"""The camera definition file: what a ground station shows a settings page from."""

from xml.sax.saxutils import escape, quoteattr

from autopilot.payload.camera.camera_settings import SETTINGS, TYPE_NAMES, Setting

VENDOR, MODEL = "Honeyguide", "Simulated camera"
VERSION = 1  # raised when the settings change: stations keep files they have fetched
FILE_NAME = "camera.xml"


def definition_xml() -> str:
    """The file."""
    parameters = "\n".join(_parameter(setting) for setting in SETTINGS)
    return f"""<?xml version="1.0" encoding="UTF-8" ?>
<mavlinkcamera>
  <definition version="{VERSION}">
    <model>{escape(MODEL)}</model>
    <vendor>{escape(VENDOR)}</vendor>
  </definition>
  <parameters>
{parameters}
  </parameters>
</mavlinkcamera>
"""


def _parameter(setting: Setting) -> str:
    options = "\n".join(
        f'        <option name={quoteattr(title)} value="{value:g}" />' for title, value in setting.options
    )
    return f"""    <parameter name="{setting.name}" type="{TYPE_NAMES[setting.kind]}" default="{setting.default:g}">
      <description>{escape(setting.title)}</description>
      <options>
{options}
      </options>
    </parameter>"""
