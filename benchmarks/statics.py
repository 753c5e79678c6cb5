"""Statics and modes against the usual ways: time, and error where the two are not equally exact.

.venv/bin/python benchmarks/statics.py

One line per case: case | ours | peer | ratio. Takes some ten seconds. Errors are relative, worst of the values
compared. Set OPENBLAS_NUM_THREADS=1 on a machine shared with other work. Needs mpmath: pip install --group bench.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_bvp
from scipy.linalg import eigh

from vibrissa.exact import cone_kappa
from vibrissa.mechanics.statics.elastica_family import family
from vibrissa.mechanics.statics.elastica_table import equilibria, equilibria_at_height
from vibrissa.mechanics.statics.profile import Posture, flat_curve

FRICTION = 0.4
POSTURE = Posture(contact=0.3, base_angle=1.2, friction=FRICTION)
LOAD = 0.868834564720600578  # of that posture, from an 18-digit Taylor series
N = 10_000
MAPS = {"ε 0.1–0.6, θ_b 0.2–1.5": (0.1, 0.6), "ε 0.02–0.95, θ_b 0.2–1.5": (0.02, 0.95)}


def best(call: Callable[[], object], repeats: int = 7) -> float:
    """Shortest of several runs, after one to warm up [s]."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def line(case: str, ours: str, peer: str = "", ratio: float | str = "") -> None:
    """One row of the table."""
    shown = ratio if isinstance(ratio, str) else f"{ratio:.3g}"
    print(f"{case:<66} | {ours:<16} | {peer:<16} | {shown}", flush=True)


# One equilibrium


def boundary_value(contact: float, base_angle: float) -> float:
    """Λ by scipy's collocation, tolerance 1e-8, with Λ as the unknown parameter."""
    phi, s = np.arctan(FRICTION), np.geomspace(contact, 1, 40)

    def slope(s, y, load):
        return np.vstack([y[1] / s**4, load[0] * np.cos(phi - y[0])])

    def ends(a, b, load):
        return np.array([a[0], a[1], b[0] - base_angle])

    guess = np.vstack([base_angle * (1 - contact / s) / (1 - contact), np.zeros_like(s)])
    load = base_angle / (np.cos(phi) * (1 / (6 * contact**2) - 1 / 2 + contact / 3))
    return float(solve_bvp(slope, ends, s, guess, p=[load], tol=1e-8, max_nodes=20_000).p[0])


def one_equilibrium() -> None:
    """A single posture."""
    contact, angle = POSTURE.contact, POSTURE.base_angle
    ours, peer = best(lambda: flat_curve(POSTURE)), best(lambda: boundary_value(contact, angle))
    errors = [abs(load / LOAD - 1) for load in (flat_curve(POSTURE).load * contact**2, boundary_value(contact, angle))]
    line(
        "one equilibrium, flat_curve : solve_bvp 1e-8",
        f"{ours * 1e3:.2f} ms, {errors[0]:.0e}",
        f"{peer * 1e3:.2f} ms, {errors[1]:.0e}",
        peer / ours,
    )
    ours = best(lambda: equilibria([contact], [angle], FRICTION))
    error = abs(equilibria([contact], [angle], FRICTION).contact_force[0] / LOAD - 1)
    line("  the same from the table at hand", f"{ours * 1e3:.2f} ms, {error:.0e}", f"{peer * 1e3:.2f} ms", peer / ours)


# Many


def from_nothing(contact: np.ndarray, base_angle: np.ndarray) -> None:
    """All postures, the table included."""
    family.cache_clear()
    equilibria(contact, base_angle, FRICTION)


def many_equilibria() -> None:
    """Ten thousand postures, against solve_bvp on twenty of them."""
    rng = np.random.default_rng(1)
    for name, reach in MAPS.items():
        contact, angle = rng.uniform(*reach, N), rng.uniform(0.2, 1.5, N)
        few = list(zip(contact[:20], angle[:20], strict=True))
        peer = best(lambda few=few: [boundary_value(*one) for one in few], 1) / 20
        height = equilibria(contact, angle, FRICTION).base_distance
        cases = {
            "with the table": lambda e=contact, b=angle: from_nothing(e, b),
            "table at hand": lambda e=contact, b=angle: equilibria(e, b, FRICTION),
            "from the height": lambda h=height, b=angle: equilibria_at_height(h, b, FRICTION),
        }
        for case, call in cases.items():
            ours = best(call) / N
            line(f"1e4 equilibria, {name}, {case}", f"{ours * 1e6:.2f} µs", f"{peer * 1e3:.2f} ms", peer / ours)
        line(f"  error of Λ, H, D against flat_curve, {name}", f"{disagreement(contact[:50], angle[:50]):.0e}")


def disagreement(contact: np.ndarray, base_angle: np.ndarray) -> float:
    """Largest relative difference of Λ, H and D between the table and postures solved alone."""
    alone = []
    for e, b in zip(contact, base_angle, strict=True):
        one = flat_curve(Posture(contact=e, base_angle=b, friction=FRICTION))
        alone.append([one.load * e**2, e * one.y[-1], e * one.x[-1]])
    return float(np.abs(np.column_stack(equilibria(contact, base_angle, FRICTION)[1:4]) / alone - 1).max())


# Modes


def beam(contact: float, elements: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness ∫ s⁴ V''W'' and mass ∫ s² V W of cubic Hermite elements, pinned at ε and clamped at the base."""
    node = np.linspace(contact, 1, elements + 1)
    h = node[1] - node[0]
    z, w = np.polynomial.legendre.leggauss(5)
    t, w = (1 + z) / 2, w / 2
    shape = np.array([1 - 3 * t**2 + 2 * t**3, h * (t - 2 * t**2 + t**3), 3 * t**2 - 2 * t**3, h * (t**3 - t**2)])
    bend = np.array([12 * t - 6, h * (6 * t - 4), 6 - 12 * t, h * (6 * t - 2)]) / h**2
    s = node[:-1, None] + h * t
    dof = 2 * np.arange(elements)[:, None] + np.arange(4)
    matrices = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for matrix, f, weight in zip(matrices, (bend, shape), (s**4, s**2), strict=True):
        np.add.at(matrix, (dof[:, :, None], dof[:, None, :]), np.einsum("iq,jq,eq->eij", f, f, h * w * weight))
    stiffness, mass = matrices
    free = np.arange(1, 2 * elements)  # without V(ε), V(1), V'(1)
    keep = np.ix_(free, free)
    return stiffness[keep], mass[keep]


def beam_kappa(contact: float) -> np.ndarray:
    """κ₁ to κ₃ as the smallest eigenvalues of stiffness over mass."""
    stiffness, mass = beam(contact)
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, 2]))


def careful_beam_kappa(contact: float) -> np.ndarray:
    """The same as the largest eigenvalues of mass over stiffness, which round-off hurts less."""
    stiffness, mass = beam(contact)
    last = len(mass) - 1
    return 1 / np.sqrt(eigh(mass, stiffness, eigvals_only=True, subset_by_index=[last - 2, last])[::-1])


def exact_kappa(contact: float, guesses: np.ndarray) -> np.ndarray:
    """κ of the pinned cone to 30 digits: the 4 × 4 determinant of Bessel functions in mpmath."""
    import mpmath as mp

    mp.mp.dps = 30

    def rows(order, kappa, s):
        z = 2 * mp.sqrt(kappa * s)
        sign = (-1) ** order
        signed = [sign * f(order, z) for f in (mp.besselj, mp.bessely, mp.besselk)]
        return [*signed, mp.besseli(order, z)]

    def determinant(kappa):
        places = ((2, 1), (3, 1), (2, mp.mpf(str(contact))), (4, mp.mpf(str(contact))))
        return mp.det(mp.matrix([rows(order, kappa, s) for order, s in places]))

    return np.array([float(mp.findroot(determinant, guess)) for guess in guesses])


def modes() -> None:
    """κ₁ to κ₃ at ε = 0.29."""
    found = cone_kappa(0.29, 3)
    known = exact_kappa(0.29, found)
    ours, error = best(lambda: cone_kappa(0.29, 3)), np.abs(found / known - 1).max()
    for name, solver in {"eigh(K, M)": beam_kappa, "eigh(M, K)": careful_beam_kappa}.items():
        peer, peer_error = best(lambda solver=solver: solver(0.29)), np.abs(solver(0.29) / known - 1).max()
        line(
            f"κ₁–κ₃ at ε = 0.29, cone_kappa : 200 Hermite elements, {name}",
            f"{ours * 1e3:.2f} ms, {error:.0e}",
            f"{peer * 1e3:.2f} ms, {peer_error:.0e}",
            peer / ours,
        )


# Start


FIRST_RING = """
import time
import numpy as np
from vibrissa.mechanics.vibration.oscillator import ring
t, event, step = np.linspace(0, 1, 1001), np.array([0.1, 0.5]), np.ones((3, 2))
start = time.perf_counter()
ring(t, event, step, step, np.array([500.0, 1500.0, 3000.0]), np.full(3, 0.1))
print(time.perf_counter() - start)
"""
FIRST_TABLE = """
import time
from vibrissa.mechanics.statics.elastica_table import equilibria
start = time.perf_counter()
equilibria([0.3], [1.2], 0.4)
print(time.perf_counter() - start)
"""


def fresh(script: str, cache: str) -> tuple[float, float]:
    """Time that a script gives for its call, and of the whole process [s], in a fresh interpreter."""
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | {"NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout), time.perf_counter() - start


def starts() -> None:
    """First call in a fresh process; the peer is the same call before numba has a cache."""
    with tempfile.TemporaryDirectory() as cache:
        cold, cold_all = fresh(FIRST_RING, cache)
        warm, warm_all = min(fresh(FIRST_RING, cache) for _ in range(3))
        table, table_all = min(fresh(FIRST_TABLE, cache) for _ in range(3))
    line("first ring() in a process, cached : cold", f"{warm:.3f} s", f"{cold:.2f} s", cold / warm)
    line("  the process with it", f"{warm_all:.2f} s", f"{cold_all:.2f} s", cold_all / warm_all)
    line("first equilibria() in a process, cached", f"{table:.3f} s of {table_all:.2f} s")


def main() -> None:
    """All cases in one run."""
    line("case", "ours", "peer", "ratio")
    one_equilibrium()
    many_equilibria()
    modes()
    starts()


if __name__ == "__main__":
    main()
