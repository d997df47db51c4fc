"""Calibration: parameters of a material from measured shots, with their intervals and correlation.

The sum of squares of (computed - measured)/scatter is minimised by a trust-region method (Branch, Coleman & Li 1999,
`scipy.optimize.least_squares`) in parameters scaled to 0..1 between their bounds. The Jacobian is made of central
differences. The runs of a point and of its differences are independent cases of the sweep. The iteration is repeated
from its start with the runs that are done until it asks for a point that is not computed: the folder holds its state.

The covariance is (J^T J / s^2 + 12 I)^-1 with s^2 = max(1, chi^2/(m - n)); 12 is the inverse variance of a parameter
known to lie between its bounds only. Intervals are Student's, of 95 %.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from math import isfinite
from pathlib import Path

import numpy as np
import scipy

from hvisph.case.sweep import Fit
from hvisph.case.units import COMMON_UNITS
from hvisph.casefile.loader import read_table
from hvisph.casefile.paths import data_folder
from hvisph.core.errors import CaseError, OutputError, suggest_nearest
from hvisph.core.measure_catalogue import CATALOGUE
from hvisph.core.text import Plain, PlainMapping
from hvisph.measures.result import weighted_quantile
from hvisph.output.reader import read_history, read_summary

from .parameters import EXPERIMENT, MATERIAL, Scale, Values, plain
from .statistics import Surrogate

SHOT = f"{EXPERIMENT}shot"
OUTLINE, HISTORY = "outline", "gauge."
PRIOR = 12.0  # inverse variance of a uniform distribution over 0..1
DETERMINED = 0.5  # of the deviation of that distribution; a parameter with a larger one is not determined
TOLERANCE = 1e-4  # change of the scaled parameters, and of the sum of squares, at which the iteration ends
DRAWS = 1 << 14
REFINEMENTS = 3


@dataclass(frozen=True)
class Datum:
    """A measured number; value and scatter in `unit`, `at` in us of a history and in mm of an outline."""

    shot: str
    quantity: str
    at: float | None
    value: float
    unit: str
    scatter: float
    source: str = ""

    @property
    def factor(self) -> float:
        """SI value of the unit."""
        return 1.0 if self.unit in ("", "-") else float(COMMON_UNITS[self.unit][1])

    def value_in(self, folder: str) -> float:
        """Return the number that a run has given, in `unit`; raises `OutputError` where it gave none."""
        measures, profile, history = _results(folder)
        if self.quantity in CATALOGUE:
            entry = measures.get(self.quantity, {})
            if entry.get("value") is None:
                raise OutputError(f"{folder} ({self.shot}): no {self.quantity}: {entry.get('reason', 'not measured')}")
            return float(entry["value"]) / self.factor
        at = self.at or 0.0
        if self.quantity == OUTLINE and profile:
            return 0.5 * float(np.interp(1e-3 * at, profile["distance"], profile["diameter"])) / self.factor
        if self.quantity in history:
            valid = np.isfinite(history[self.quantity])  # a gauge of its own `every` is empty in other lines
            if valid.any():
                return float(np.interp(1e-6 * at, history["time"][valid], history[self.quantity][valid])) / self.factor
        raise OutputError(f"{folder} ({self.shot}) has no {self.quantity}")


@lru_cache(maxsize=4096)
def _results(folder: str) -> tuple[Plain, Plain, dict[str, np.ndarray]]:
    summary, history = read_summary(folder), read_history(folder)
    columns = {name: column for name, column in history.items() if name == "time" or name.startswith(HISTORY)}
    return summary["measures"], summary.get("profile") or {}, columns


def with_data(fit: Fit, folder: Path) -> Fit:
    """Return the fit with the rows of its files in place of their names; raises `CaseError` for invalid rows."""
    shots = {str(row.get("shot", "")): row for row in _rows(fit.shots, folder, "shots")}
    names = [name for name in shots if fit.only is None or any(fnmatchcase(name, pattern) for pattern in fit.only)]
    if "" in shots:
        raise CaseError("every shot needs a name in the column `shot`", where="shots")
    if not names:
        raise CaseError(f"there is no such shot{suggest_nearest(str(fit.only), list(shots))}", where="only")
    rows = []
    for row in _rows(fit.measured, folder, "measured"):
        shot = str(row.get("shot"))
        if shot not in shots:
            raise CaseError(f"unknown shot '{shot}'{suggest_nearest(shot, list(shots))}", where="measured")
        counts = shot in names and str(row.get("judged") or "yes") == "yes"
        if counts and (fit.quantities is None or row.get("quantity") in fit.quantities):
            _datum(row)
            rows.append(dict(row))
    if len(rows) < len(fit.parameters):
        message = f"{len(rows)} measured numbers do not determine {len(fit.parameters)} parameters"
        raise CaseError(message, where="measured")
    shots_used = {str(row["shot"]) for row in rows}
    settings = [{k: v for k, v in row.items() if v != ""} for name, row in shots.items() if name in shots_used]
    return fit.model_copy(update={"shots": settings, "measured": rows})


def _rows(source: str | Sequence[PlainMapping], folder: Path, where: str) -> Sequence[PlainMapping]:
    """Return the rows of a file beside the fit's or among the bundled cases, or those that are given."""
    if not isinstance(source, str):
        return source
    path = next((file for file in (folder / source, data_folder("cases") / source) if file.is_file()), None)
    if path is None:
        raise CaseError(f"there is no file '{source}'", where=where)
    return read_table(path)


def _datum(row: PlainMapping) -> Datum:
    """Return a measured number from its row; raises `CaseError` for an invalid one."""
    quantity, unit, where = str(row.get("quantity")), str(row.get("unit") or ""), f"measured.{row.get('shot')}"
    if quantity not in CATALOGUE and quantity != OUTLINE and not quantity.startswith(HISTORY):
        raise CaseError(f"there is no measure '{quantity}'{suggest_nearest(quantity, list(CATALOGUE))}", where=where)
    if unit not in ("", "-") and unit not in COMMON_UNITS:
        raise CaseError(f"unknown unit '{unit}' of {quantity}", where=where)
    if (quantity == OUTLINE or quantity.startswith(HISTORY)) and row.get("at") in (None, ""):
        raise CaseError(f"{quantity} needs `at`", where=where)
    try:
        at = None if row.get("at") in (None, "") else float(str(row["at"]))
        value, scatter = float(str(row.get("value"))), float(str(row.get("scatter")))
    except ValueError:
        raise CaseError(f"{quantity} needs a value and its scatter as numbers", where=where) from None
    if not (scatter > 0.0 and isfinite(value) and isfinite(scatter)):
        raise CaseError(f"{quantity} needs a finite value, and a scatter above 0: it is the weight", where=where)
    return Datum(str(row["shot"]), quantity, at, value, unit, scatter, str(row.get("source") or ""))


class _MissingRunsError(Exception):
    """Points whose cases have not been computed."""

    def __init__(self, points: np.ndarray):
        self.points = points


class Calibration:
    """A fit with its data (see `with_data`), and the runs that are done."""

    def __init__(self, fit: Fit, base: PlainMapping, rows: Sequence[PlainMapping] = ()):
        self.fit, self.base = fit, base
        self.shots = {str(row["shot"]): row for row in fit.shots if isinstance(row, dict)}
        self.data = [_datum(row) for row in fit.measured if isinstance(row, dict)]
        parameters = fit.parameters.items()
        self.scales = [Scale(self._paths(path)[0], [fitted.start, *fitted.bounds], base) for path, fitted in parameters]
        for datum in self.data:
            gauge = datum.quantity.removeprefix(HISTORY).split(".")[0]
            if datum.quantity.startswith(HISTORY) and gauge not in base.get("gauges", {}):
                raise CaseError(f"the case has no gauge '{gauge}'", where="measured")
        start, self.lower, upper = np.array([scale.numbers for scale in self.scales]).T
        for path, a, x, b in zip(fit.parameters, self.lower, start, upper, strict=True):
            if not a < x < b:
                message = "the start has to lie between the bounds, the lower one first"
                raise CaseError(message, where=f"parameters.{path}")
        self.range = upper - self.lower
        self.start = (start - self.lower) / self.range
        self.folders = {self._key(str(row["values"].get(SHOT)), row["values"]): row["folder"] for row in rows}

    def _paths(self, path: str) -> list[str]:
        """Return the settings of a parameter."""
        if not path.startswith(MATERIAL):
            return [path]
        bodies = (self.fit.material.bodies if self.fit.material else None) or list(self.base.get("bodies") or ())
        return [f"bodies.{body}.{path}" for body in bodies]

    def _key(self, shot: str, values: PlainMapping) -> tuple[str, ...]:
        return shot, *(str(values.get(self._paths(path)[0])) for path in self.fit.parameters)

    def _parameters(self, u: np.ndarray) -> Values:
        values: Values = {}
        for path, scale, number in zip(self.fit.parameters, self.scales, self.lower + u * self.range, strict=True):
            values |= dict.fromkeys(self._paths(path), scale.value(float(number)))
        return values

    def cases(self, points: np.ndarray) -> list[Values]:
        """Return the cases of all shots at points of the unit cube that are not done."""
        cases = {}
        for u in points:
            values = self._parameters(u)
            for shot, settings in self.shots.items():
                fixed = {
                    path: plain(str(cell)) if isinstance(cell, str) else cell
                    for path, cell in settings.items()
                    if path != "shot" and not path.startswith(EXPERIMENT)
                }
                if (key := self._key(shot, values)) not in self.folders:
                    cases[key] = {SHOT: shot} | fixed | values
        return list(cases.values())

    def first(self) -> list[Values]:
        """Return the cases of the first round."""
        return self.cases(self._design() if self.fit.method == "surrogate" else self._stencil(self.start))

    def solve(self) -> tuple[list[Values], Plain]:
        """Return the cases that are needed next, and the result, which is empty as long as there are some."""
        try:
            return [], self._surrogate() if self.fit.method == "surrogate" else self._least_squares()
        except _MissingRunsError as missing:
            return self.cases(missing.points), {}

    def _evaluate(self, points: np.ndarray) -> np.ndarray:
        """Return the results of the runs at points, (k, m)."""
        if self.cases(points):
            raise _MissingRunsError(points)
        cases, folders = [self._parameters(u) for u in points], self.folders
        return np.array(
            [[datum.value_in(folders[self._key(datum.shot, case)]) for datum in self.data] for case in cases]
        )

    def _residuals(self, computed: np.ndarray) -> np.ndarray:
        """Return (computed - measured)/scatter."""
        measured, scatter = np.array([[datum.value, datum.scatter] for datum in self.data]).T
        return np.asarray((computed - measured) / scatter)

    def _stencil(self, u: np.ndarray) -> np.ndarray:
        """Return a point, and its neighbours on both sides in each parameter, within the bounds."""
        steps = self.fit.step * np.eye(len(u))
        return np.clip(np.vstack([u, u + steps, u - steps]), 0.0, 1.0)

    def _linearize(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return weighted residuals and their derivatives with respect to the scaled parameters."""
        points = self._stencil(u)
        residuals, n = self._residuals(self._evaluate(points)), len(u)
        steps = (points[1 : n + 1] - points[n + 1 :]).sum(axis=1)
        return residuals[0], ((residuals[1 : n + 1] - residuals[n + 1 :]) / steps[:, None]).T

    def _least_squares(self) -> Plain:
        optimum = scipy.optimize.least_squares(
            lambda u: self._linearize(u)[0],
            self.start,
            jac=lambda u: self._linearize(u)[1],
            bounds=(0.0, 1.0),
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            max_nfev=self.fit.iterations,
        )
        residuals, jacobian = self._linearize(optimum.x)
        freedom = max(len(residuals) - len(optimum.x), 1)
        spread = max(1.0, float(residuals @ residuals) / freedom)
        covariance = np.linalg.inv(jacobian.T @ jacobian / spread + PRIOR * np.eye(len(optimum.x)))
        half = float(scipy.stats.t.ppf(0.975, freedom)) * np.sqrt(np.diag(covariance))
        bounds = np.clip([optimum.x - half, optimum.x + half], 0.0, 1.0)
        text = f"least squares, {optimum.nfev} iterations"
        if optimum.status == 0:
            text += ", not converged: give more `iterations` or another start"
        computed = self._evaluate(optimum.x[None])[0]
        return self._result(optimum.x, covariance, bounds, computed, {"method": text, "converged": optimum.status > 0})

    def _design(self) -> np.ndarray:
        """Return the points of a surrogate."""
        return np.asarray(scipy.stats.qmc.LatinHypercube(len(self.scales), rng=0).random(self.fit.count))

    def _surrogate(self) -> Plain:
        """Return mean and covariance of the posterior by importance sampling of response surfaces."""
        points = self._design()
        computed = self._evaluate(points)
        surfaces = [Surrogate(points, column) for column in computed.T]
        scatter = np.hypot([datum.scatter for datum in self.data], [surface.error for surface in surfaces])
        measured = np.array([datum.value for datum in self.data])

        def predict(u: np.ndarray) -> np.ndarray:
            return np.stack([surface.predict(u) for surface in surfaces], axis=1)

        draws = scipy.stats.qmc.Sobol(len(self.scales), rng=0).random(DRAWS)
        density = np.zeros(DRAWS)
        for k in range(REFINEMENTS + 1):
            likelihood = -0.5 * (((predict(draws) - measured) / scatter) ** 2).sum(axis=1) - density
            weights = np.exp(likelihood - likelihood.max())
            weights /= weights.sum()
            mean = weights @ draws
            covariance = (draws - mean).T @ ((draws - mean) * weights[:, None]) + 1e-10 * np.eye(len(mean))
            if k < REFINEMENTS:
                proposal = scipy.stats.multivariate_normal(mean, 2.0 * covariance, seed=k)
                draws = np.atleast_2d(proposal.rvs(DRAWS).T).T
                draws = draws[((draws >= 0.0) & (draws <= 1.0)).all(axis=1)]
                density = proposal.logpdf(draws)
        bounds = np.array([[weighted_quantile(u, weights, share) for u in draws.T] for share in (0.025, 0.975)])
        sobol = [surface.sobol([scipy.stats.uniform()] * len(mean)) if len(mean) > 1 else None for surface in surfaces]
        details = {
            "method": f"posterior of a response surface of {self.fit.count} points",
            "converged": True,
            "effective_draws": float(1.0 / (weights**2).sum()),
            "surrogates": [
                {"kind": surface.kind, "error": surface.error, "share": surface.share, "sobol": indices}
                for surface, indices in zip(surfaces, sobol, strict=True)
            ],
        }
        return self._result(mean, covariance, bounds, predict(mean[None])[0], details)

    def _result(
        self, u: np.ndarray, covariance: np.ndarray, bounds: np.ndarray, computed: np.ndarray, details: Plain
    ) -> Plain:
        deviation = np.sqrt(np.diag(covariance))
        residuals = self._residuals(computed)
        parameters = {}
        for k, (path, scale) in enumerate(zip(self.fit.parameters, self.scales, strict=True)):
            low, high = (float(self.lower[k] + self.range[k] * bound[k]) for bound in bounds)
            parameters[path] = {
                "value": float(self.lower[k] + self.range[k] * u[k]),
                "unit": scale.unit,
                "deviation": float(self.range[k] * deviation[k]),
                "interval": [low, high],
                "determined": bool(deviation[k] < DETERMINED / np.sqrt(PRIOR)),
                "at_bound": bool(min(u[k], 1.0 - u[k]) < 1e-3),
            }
        material = self.fit.material.model_dump() if self.fit.material else None
        return details | {
            "parameters": parameters,
            "material": material,
            "correlation": (covariance / np.outer(deviation, deviation)).tolist(),
            "sum_of_squares": float(residuals @ residuals),
            "freedom": max(len(residuals) - len(u), 0),
            "data": [
                asdict(datum) | {"computed": float(value), "residual": float(residual)}
                for datum, value, residual in zip(self.data, computed, residuals, strict=True)
            ],
        }


def material_document(fit: PlainMapping, day: str, version: str) -> Plain:
    """Return the material of a fit's result as a file of the library holds it, its data and date as the source."""
    document: Plain = {"base": fit["material"]["base"]}
    of_material = [path for path in fit["parameters"] if path.startswith(MATERIAL)]
    names = {path.removeprefix(MATERIAL): fit["parameters"][path] for path in of_material}
    shots = list(dict.fromkeys(datum["shot"] for datum in fit["data"]))
    sources = "; ".join(dict.fromkeys(datum["source"] for datum in fit["data"] if datum["source"]))
    data = f"{len(fit['data'])} numbers of {', '.join(shots)}{f' ({sources})' if sources else ''}"
    parameters = "; ".join(map(parameter_text, names, names.values()))
    text = f"Fitted by hvisph {version} on {day} to {data}: {fit['method']}; {parameters}"
    document["sources"] = [{"of": list(names), "confidence": "derived", "text": text}]
    for name, parameter in names.items():
        *above, key = name.split(".")
        block = document
        for part in above:
            block = block.setdefault(part, {})
        number, unit = f"{parameter['value']:.6g}", parameter["unit"]
        block[key] = f"{number} {unit}" if unit else float(number)
    return document


def parameter_text(name: str, parameter: PlainMapping) -> str:
    """Return a fitted parameter with its interval in words."""
    low, high = parameter["interval"]
    unit = f" {parameter['unit']}" if parameter["unit"] else ""
    doubt = "" if parameter["determined"] else ", not determined by the data"
    bound = ", at its bound" if parameter["at_bound"] else ""
    return f"{name} {parameter['value']:.4g}{unit} (95 %: {low:.4g} to {high:.4g}{doubt}{bound})"
