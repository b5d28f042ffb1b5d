"""``validate``: what the validators of photometry and USD's own say of a stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pxr import Tf, Usd, UsdValidation

import hdrusd.validation  # noqa: F401  # registers ours
from hdrusd.usd.opening import one_line_of

#: USD's own validators that ``validate`` runs: whether the stage composes, says what
#: it is and refers to what exists, and whether lights and materials stand where they may.
#: Units and up axis are with StageUnits; checks of every mesh are left out for their cost.
BUILT_IN = (
    "usdValidation:CompositionErrorTest",
    "usdValidation:StageMetadataChecker",
    "usdLuxValidators:EncapsulationRulesValidator",
    "usdShadeValidators:EncapsulationMaterialValidator",
    "usdShadeValidators:MaterialBindingApiAppliedValidator",
    "usdShadeValidators:MaterialBindingRelationships",
    "usdUtilsValidators:MissingReferenceValidator",
)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that a validator found."""

    severity: Literal["error", "warning"]
    validator: str  # "LightIntensity"; USD's own with their plug-in: "usdLuxValidators:..."
    path: str  # of the prim or property, "/" for the stage
    text: str

    def __str__(self) -> str:
        return f"{self.path}: {self.text}"


def validate(stage: Usd.Stage) -> list[Problem]:
    """What the validators of keyword "hdrusd" and ``BUILT_IN`` say of a stage, errors first."""
    registry = UsdValidation.ValidationRegistry()
    # By keyword, so that validators that other packages file under ours run as well.
    ours = [found.name for found in registry.GetValidatorMetadataForKeyword("hdrusd")]
    names = [*ours, *BUILT_IN]
    try:
        problems = _run(stage, names)
    except Tf.ErrorException:  # of a layer that cannot be parsed; the others have their say
        problems = set().union(*(_run_alone(stage, name) for name in names))
    return sorted(problems, key=lambda p: (p.severity, p.path, p.validator, p.text))


def _run(stage: Usd.Stage, names: Sequence[str]) -> set[Problem]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadValidatorsByName(names)
    return {
        _problem(error) for error in UsdValidation.ValidationContext(validators).Validate(stage)
    }


def _run_alone(stage: Usd.Stage, name: str) -> set[Problem]:
    try:
        return _run(stage, [name])
    except Tf.ErrorException as problem:
        text = f"the check broke down: {one_line_of(problem)}"
        return {Problem("error", _short(name), "/", text)}


def _short(name: str) -> str:
    return name.removeprefix("hdrusd.validation:")


def _problem(error: UsdValidation.ValidationError) -> Problem:
    grave = error.GetType() == UsdValidation.ValidationErrorType.Error
    name = _short(error.GetValidator().GetMetadata().name)
    path = next((_site_path(site) for site in error.GetSites()), "/")
    text = " ".join(error.GetMessage().split())
    return Problem("error" if grave else "warning", name, path, text)


def _site_path(site: UsdValidation.ValidationErrorSite) -> str:
    if site.IsProperty():
        return str(site.GetProperty().GetPath())
    return str(site.GetPrim().GetPath()) if site.IsPrim() else "/"
