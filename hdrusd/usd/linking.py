"""Light linking and shadow linking: which surfaces a light reaches, and which shade it.

``collection:lightLink`` and ``collection:shadowLink`` of a light by USD's own membership
query. Those that say the same share a number; a surface carries a bit for each number that
names it. A copy by a point instancer belongs where its prototype's prim does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Usd, UsdLux

from hdrusd.report import Kind, Report
from hdrusd.usd.findings import prim_finding

#: Different light links of one stage: the bits that a float32 holds exactly.
MOST_LINKS = 24

#: Different shadow links to everything but something, as lamps leave out their own poles;
#: of others as many as of light links.
MOST_EXCLUDED = 4096


class Links:
    """The links of the lights of one stage: ``note`` every light, then ask for bits."""

    def __init__(self, stage: Usd.Stage, report: Report) -> None:
        def beyond(prim: Usd.Prim, text: str) -> None:
            prim_finding(report, prim, Kind.DROPPED, "light-linking", text)

        self._reach = _Family(MOST_LINKS, "light links; it reaches everything", beyond)
        self._shade = _Family(MOST_EXCLUDED, "shadow links; everything shades it", beyond)
        self._lights: dict[Sdf.Path, tuple[int, int]] = {}
        self._bits: dict[Sdf.Path, tuple[int, int]] = {}

    def note(self, prim: Usd.Prim) -> tuple[int, int]:
        """The numbers of a light's two links; 0 for a link to everything."""
        path = prim.GetPath()
        if path not in self._lights:
            api = UsdLux.LightAPI(prim)
            self._lights[path] = (
                self._reach.number(prim, api.GetLightLinkCollectionAPI()),
                self._shade.number(prim, api.GetShadowLinkCollectionAPI()),
            )
        return self._lights[path]

    def assign(self, prim: Usd.Prim, rows: npt.NDArray[np.void]) -> None:
        """Give rows of ``scene.LIGHT``, all of one light, its links."""
        rows["link"], rows["shadow_link"] = self.note(prim)

    def bits(self, path: Sdf.Path) -> tuple[int, int]:
        """``Draw.links`` and ``Draw.shadow_links`` of the surface at a path."""
        if path not in self._bits:
            self._bits[path] = self._reach.bits(path), self._shade.bits(path)
        return self._bits[path]


class _Family:
    """The different links of one kind, numbered from 1; ``beyond`` is told of what is too much."""

    def __init__(self, most: int, what: str, beyond: Callable[[Usd.Prim, str], None]) -> None:
        self.most = most
        self._what, self._beyond = what, beyond
        self._numbers: dict[tuple[tuple[str, str], ...], int] = {}
        self._queries: dict[int, Usd.CollectionMembershipQuery] = {}
        # Of links to everything but some: these bits, but for those of the excluded.
        self._most_things = 0
        self._excluded: dict[Sdf.Path, int] = {}

    def number(self, prim: Usd.Prim, collection: Usd.CollectionAPI) -> int:
        """The number of a light's link; 0 for a link to everything."""
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
            others = {rule for path, rule in key if path != "/"}
            simple = ("/", "expandPrims") in key and others == {"exclude"}
            full = len(self._numbers) >= self.most
            if full or (not simple and len(self._queries) >= MOST_LINKS):
                most = self.most if full else MOST_LINKS
                self._beyond(prim, f"more than {most} different {self._what}")
                return 0
            number = self._numbers[key] = len(self._numbers) + 1
            if simple:
                self._exclude(number, [path for path in rules if path != Sdf.Path("/")])
            else:
                self._queries[number] = query
        return self._numbers[key]

    def bits(self, path: Sdf.Path) -> int:
        """A bit for each link that names the surface at a path."""
        named = 0
        for above in path.GetPrefixes():
            named |= self._excluded.get(above, 0)
        named = self._most_things & ~named
        for number, query in self._queries.items():
            if query.IsPathIncluded(path):
                named |= 1 << (number - 1)
        return named

    def _exclude(self, number: int, paths: list[Sdf.Path]) -> None:
        bit = 1 << (number - 1)
        self._most_things |= bit
        for path in paths:
            self._excluded[path] = self._excluded.get(path, 0) | bit
