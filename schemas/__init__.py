"""The USD schemas of hdrusd: a codeless plug-in that this package registers.

``schema.usda`` is the source and the documentation; ``tools/regenerate.py`` makes
``generatedSchema.usda`` and ``plugInfo.json`` from it. Programs that do not import
hdrusd find the plug-in through ``PXR_PLUGINPATH_NAME``; programs without it still
open our stages, and read the UsdLux and UsdPreviewSurface values.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from hdrusd.errors import SchemaRegistrationError

#: What ``PXR_PLUGINPATH_NAME`` must contain for other programs.
PLUGIN_DIR = Path(__file__).resolve().parent

#: Names to apply, as ``prim.ApplyAPI`` and ``apiSchemas`` have them.
API_SCHEMAS = (
    "HdrusdPhotometricLightAPI",
    "HdrusdPhotometricMaterialAPI",
    "HdrusdAmbientAPI",
    "HdrusdEyeAPI",
)


@cache
def register() -> None:
    """Make the schemas and validators known to USD; later calls do nothing.

    USD fixes its list of schemas when it composes the first typed prim, and asking whether
    ours are in it fixes it too: plug-ins with schemas of their own must be
    registered before. SchemaRegistrationError when a stage came first.
    """
    # Not at the top: `hdrusd schemas` prints PLUGIN_DIR without waiting for USD.
    from pxr import Plug, Usd

    # An environment that set PXR_PLUGINPATH_NAME has registered it already.
    if not Plug.Registry().GetPluginWithName("hdrusd"):
        Plug.Registry().RegisterPlugins(str(PLUGIN_DIR))
    known = Usd.SchemaRegistry()
    missing = [name for name in API_SCHEMAS if not known.FindAppliedAPIPrimDefinition(name)]
    if missing:
        raise SchemaRegistrationError(
            f"USD schemas: {', '.join(missing)}: unknown, because a stage was opened "
            f"before hdrusd registered them; import hdrusd.usd first, "
            f"or set PXR_PLUGINPATH_NAME={PLUGIN_DIR}"
        )
