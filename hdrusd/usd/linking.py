"""Light linking and shadow linking: which surfaces a light reaches, and which shade it.

``collection:lightLink`` and ``collection:shadowLink`` of a light by USD's own membership
query. Those that say the same share a number; a surface carries a bit for each number that
names it. A copy by a point instancer belongs where its prototype's prim does.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdLux

from hdrusd.errors import SourceRef
from hdrusd.report import Kind, Report

#: Different links of one stage: the bits that a float32 holds exactly.
MOST_LINKS = 24


class Links:
    """The links of the lights of one stage: ``note`` every light, then ask for bits."""

    def __init__(self, stage: Usd.Stage, report: Report) -> None:
        self.report = report
        self._place = SourceRef(Path(stage.GetRootLayer().identifier))
        self._queries: list[Usd.CollectionMembershipQuery] = []
        self._numbers: dict[tuple[tuple[str, str], ...], int] = {}
        self._lights: dict[Sdf.Path, tuple[int, int]] = {}
        self._bits: dict[Sdf.Path, int] = {}

    def note(self, prim: Usd.Prim) -> tuple[int, int]:
        """The numbers of a light's two links; 0 for a link to everything."""
        path = prim.GetPath()
        if path not in self._lights:
            api = UsdLux.LightAPI(prim)
            self._lights[path] = (
                self._number(prim, api.GetLightLinkCollectionAPI()),
                self._number(prim, api.GetShadowLinkCollectionAPI()),
            )
        return self._lights[path]

    def assign(self, prim: Usd.Prim, rows: npt.NDArray[np.void]) -> None:
        """Give rows of ``scene.LIGHT``, all of one light, its links."""
        rows["link"], rows["shadow_link"] = self.note(prim)

    def bits(self, path: Sdf.Path) -> int:
        """``Draw.links`` of the surface at a path."""
        if path not in self._bits:
            named = [query.IsPathIncluded(path) for query in self._queries]
            self._bits[path] = sum(1 << index for index, it in enumerate(named) if it)
        return self._bits[path]

    def _number(self, prim: Usd.Prim, collection: Usd.CollectionAPI) -> int:
        # Most lights say nothing of it, and a query costs.
        name = f"collection:{collection.GetName()}"
        if not any(p.GetName().startswith(name) for p in prim.GetAuthoredProperties()):
            return 0
        query = collection.ComputeMembershipQuery()
        rules = query.GetAsPathExpansionRuleMap()
        expression = str(collection.GetMembershipExpressionAttr().Get() or "")
        if not rules and expression:
            key: tuple[tuple[str, str], ...] = ((expression, str(prim.GetPath())),)
        else:
            key = tuple(sorted((str(path), str(rule)) for path, rule in rules.items()))
            if ("/", "expandPrims") in key and all(rule == "expandPrims" for _, rule in key):
                return 0
        if key not in self._numbers:
            if len(self._queries) == MOST_LINKS:
                text = f"more than {MOST_LINKS} different links; it reaches everything"
                self.report.add(
                    Kind.DROPPED, "light-linking", self._place, str(prim.GetPath()), text
                )
                return 0
            self._queries.append(query)
            self._numbers[key] = len(self._queries)
        return self._numbers[key]
