"""The contact law in plain Python, written from its formulas: printed, consistent, and between bodies."""

import numpy as np

from hvisph.sph.contact.contact_normal import CLOSED, FACING_COSINE, NORMAL_COSINE_MIN, OPEN
from hvisph.sph.contact.riemann_contact import PRESSED
from hvisph.sph.contact.variable_resolution import DEPTH_MIN, DEPTH_RANGE, depths
from hvisph.sph.terms.angular_momentum import TORQUE_GAIN_MAX
from hvisph.sph.terms.free_surface_correction import CORRECTABLE_MIN
from hvisph.sph.terms.reconstruction import MIN_LIMITER
from hvisph.sph.terms.riemann_solver import FRONT, SHEAR_IMPEDANCE_MIN, SHOCK_SLOPE
from hvisph.sph.terms.shape_matrix import SINGULAR
from hvisph.sph.terms.tension_stabilization import TENSION_GAIN


def torque(x, f):
    """Return x x f, of vectors in the plane (1,)."""
    found = np.cross(np.pad(x, (0, 3 - len(x))), np.pad(f, (0, 3 - len(f))))
    return found if len(x) == 3 else found[2:]


def about(w, x):
    """Return w x x."""
    return np.cross(np.concatenate([np.zeros(3 - len(w)), w]), np.pad(x, (0, 3 - len(x))))[: len(x)]


def limited(name, d, other, least=0.0):
    """Return the limited slope of vectors: `d` times the limiter's share of it along `d`, or `least`."""
    a, b = d @ d, other @ d
    if a == 0.0 or b <= 0.0:
        return least * d
    share = {"minmod": min(a, b), "van_leer": 2.0 * a * b / (a + b), "van_albada": a * b * (a + b) / (a * a + b * b)}
    return max(share[name] / a, least) * d


def gap_factor_of(fills, free):
    """Return the gap factor of a contact."""
    return 1.0 if free <= 0.0 else np.clip((fills / free - OPEN) / (CLOSED - OPEN), 0.0, 1.0)


class Pairs:
    """What the pairs of a cloud have in common: neighbours, distances, slopes, normals of interfaces."""

    def __init__(self, cloud, formulation, neighbours):
        self.cloud, self.formulation, self.kernel, self.dim = cloud, formulation, formulation.kernel, cloud.dim
        own = formulation.corrected_variant and formulation.smoothing.variable
        self.near = [neighbours(cloud, self.kernel, a, own) for a in range(len(cloud.x))]
        self.volume = cloud.m / cloud.rho
        self.fills, self.ends = np.zeros_like(cloud.x), np.zeros_like(cloud.x)
        for a, near in enumerate(self.near):
            for b in near:
                _, e, slope = self.geometry(a, b)
                if not self.other(a, b):
                    self.ends[a] -= self.volume[b] * slope * e
                else:
                    self.fills[a] += self.volume[b] * slope * e
        if formulation.unequal_spacings:
            table = depths(self.kernel, formulation.h_over_dx).reshape(3, -1)[self.dim - 1]
            faint = np.sqrt(2 * np.maximum(-np.log(np.linalg.norm(self.ends, axis=1) * cloud.h / table[0] + 1e-30), 0))
            depth = np.interp(faint, np.linspace(0, DEPTH_RANGE, len(table) - 1), table[1:])
            self.depth = cloud.h * np.maximum(depth, DEPTH_MIN)
            for a, near in enumerate(self.near):
                self.fills[a] = sum((self.filled(a, b) for b in near if self.other(a, b)), self.fills[a] * 0)
        self.fills = np.array([self.smooth(a) for a in range(len(cloud.x))])

    def smooth(self, a):
        """Return what fills the room of a, along the mean direction about it of what looks as it does."""
        own, h, reach = self.fills[a], self.cloud.h, self.kernel.reach
        if not own.any():
            return own
        mean = self.volume[a] / h[a] ** self.dim * own
        for b in self.near[a]:
            length = 0.5 * (h[a] + h[b])
            its = -self.fills[b] if self.other(a, b) else self.fills[b]
            if its.any():
                alike = (max(own @ its, 0.0) / np.linalg.norm(own) / np.linalg.norm(its)) ** 2
                flat = max(1.0 - (self.geometry(a, b)[0] / (reach * length)) ** 2, 0.0)
                mean = mean + self.volume[b] / length**self.dim * flat * alike * its
        along = mean / np.linalg.norm(mean)
        return (own @ along) * along

    def along_normal(self, a, b):
        """Return k of unlike spacings."""
        h, depth = self.cloud.h, self.depth
        return (depth[a] / h[a] + depth[b] / h[b]) / (depth[a] + depth[b])

    def stretched(self, a, b, n):
        """Return k, h_ab, s, the vector t, and w'(q) norm / (h_a h_b h_ab^(dim - 1) q) of unlike spacings."""
        h, x_ba = self.cloud.h, self.cloud.x[b] - self.cloud.x[a]
        k, mean, s = self.along_normal(a, b), 0.5 * (h[a] + h[b]), x_ba @ n
        t = x_ba - s * n
        q = np.hypot(k * s, np.linalg.norm(t) / mean)
        norm = self.kernel.norm(self.dim) / (h[a] * h[b] * mean ** (self.dim - 1))
        return k, mean, s, t, -norm * self.kernel.slope.py_func(q) / q

    def filled(self, a, b):
        """Return what b fills of what a lacks, the gradient of the stretched kernel over k."""
        n = self.ends[a] - self.ends[b]
        n = n / (np.linalg.norm(n) + 1e-30)
        k, mean, s, t, slope = self.stretched(a, b, n)
        return self.volume[b] * slope * (k * s * n + t / (mean * mean * k))

    def geometry(self, a, b):
        """Return distance, line of centres and |dW/dr|."""
        x_ba = self.cloud.x[b] - self.cloud.x[a]
        r, h = np.linalg.norm(x_ba), 0.5 * (self.cloud.h[a] + self.cloud.h[b])
        return r, x_ba / r, -self.kernel.derivative(r, h, self.dim)

    def has_contact(self, a, b):
        """Whether the pair is one of different bodies that part."""
        return self.formulation.has_contact and self.other(a, b)

    def other(self, a, b):
        """Whether a pair is of different bodies, or of faces of one that look at each other."""
        cloud = self.cloud
        _, e, _ = self.geometry(a, b)
        of_a, of_b = cloud.face[a] @ e, -cloud.face[b] @ e
        looks = self.formulation.self_contact and max(of_a, of_b, of_a + of_b) > FACING_COSINE
        return looks or cloud.body[a] != cloud.body[b]

    def gradient(self, a, values, singular):
        """Return the renormalised gradient at `a` of `values` over the own body, the derivative's axis last."""
        shape, found = np.zeros((self.dim, self.dim)), np.zeros((*values.shape[1:], self.dim))
        for b in self.near[a]:
            if self.has_contact(a, b):
                continue
            r, e, slope = self.geometry(a, b)
            g = self.volume[b] * slope * e
            shape += np.outer(r * e, g)
            found += np.multiply.outer(values[b] - values[a], g)
        mean = np.trace(shape) / self.dim
        if mean > singular and np.linalg.det(shape) > singular * mean**self.dim:
            return found @ np.linalg.inv(shape)
        return found

    def across(self, a, b, e):
        """Return normal, cosine and gap factor of a pair of different bodies."""
        fills = self.fills[a] - self.fills[b]
        n = fills / np.linalg.norm(fills)
        free = (self.ends[a] - self.ends[b]) @ n
        gap_factor = gap_factor_of(np.linalg.norm(fills), free)
        return (n, n @ e, gap_factor) if n @ e >= NORMAL_COSINE_MIN else (e, 1.0, gap_factor)


def gradients_before(cloud):
    """Return velocity gradients (n, dim, dim) that stand for those of the evaluation before."""
    return 1e6 * cloud.face[:, :, None] * cloud.face[:, None, :]


def ahead_twice(cloud):
    """Return twice the time of the stage (n,) [s], negative where the material flows."""
    return 2e-8 * np.sign(cloud.heat - 0.5e6)


def operators(pairs, grad_u):
    """Return K, the share with which it holds, and the stress at the stage of all particles."""
    cloud, dim, shares, one = pairs.cloud, pairs.dim, [], np.eye(pairs.dim)
    found, stage = [], []
    for a in range(len(cloud.x)):
        moment, across, fills = np.zeros((dim, dim)), np.zeros((dim, dim)), np.zeros(dim)
        for b in pairs.near[a]:
            r, e, slope = pairs.geometry(a, b)
            if pairs.has_contact(a, b):
                across += pairs.volume[b] * slope * r * np.outer(e, e)
                fills += pairs.volume[b] * slope * e
            else:
                moment += pairs.volume[b] * slope * r * np.outer(e, e)
        if fills.any():
            n = fills / np.linalg.norm(fills)
            free = max(pairs.ends[a] @ n, 0.0)
            gap_factor = gap_factor_of(np.linalg.norm(fills), free)
            moment += gap_factor * (n @ across @ n) * np.outer(n, n)
        share = max(cloud.order[a], 0.0) if correctable(moment) else 0.0
        inverse = np.linalg.inv(moment) if share else one
        change = share * (grad_u[a] - gradients_before(cloud)[a])
        stiff, shear = cloud.rho[a] * cloud.c_l[a] ** 2, cloud.rho[a] * cloud.c_t[a] ** 2
        time = ahead_twice(cloud)[a]
        if time < 0.0:
            stiff, shear = stiff - 4.0 / 3.0 * shear, 0.0
        strain = 0.5 * (change + change.T)
        stage.append(
            cloud.stress[a] + abs(time) * (2.0 * shear * strain + (stiff - 2.0 * shear) * np.trace(strain) * one)
        )
        found.append(one + share * (inverse - one))
        shares.append(share)
    return np.array(found), np.array(shares), np.array(stage)


def contact(pairs, grad_u, grad_s, a, b):
    """Return u* of `a`, t*, normal, |dW/dr|, weight in the gradient, heat of slip and of the gap, what the density
    goes without, the heat that `b` conducts to `a`, and the share of its closing that a lead counts, of a pair."""
    cloud, formulation = pairs.cloud, pairs.formulation
    r, e, slope = pairs.geometry(a, b)
    x_ba, has_contact, gap_factor = r * e, pairs.has_contact(a, b), 1.0
    if has_contact:
        e, cosine, gap_factor = pairs.across(a, b, e)
        slope = slope * cosine
        if formulation.unequal_spacings:
            k, _, s, _, slope = pairs.stretched(a, b, e)
            slope *= k * s
    along = np.outer(e, e)
    sides, elastic, grows, mean = {}, 0.0, 1.0, np.zeros(pairs.dim)
    if formulation.adjoint:
        elastic = 0.0 if has_contact else min(pairs.elastic[a], pairs.elastic[b])
        grows = e @ (pairs.operator[a] + pairs.operator[b]) @ e / 2.0
        mean = (pairs.stress[a] @ pairs.operator[a] + pairs.stress[b] @ pairs.operator[b]) @ e / 2.0
    for name, part in (("normal", along), ("tangential", np.eye(pairs.dim) - along)):
        ua, ub = part @ cloud.u[a], part @ cloud.u[b]
        ta, tb = part @ pairs.stress[a] @ e, part @ pairs.stress[b] @ e
        if formulation.reconstruction.acts and not has_contact:
            for_u, for_t = ub - ua, tb - ta
            limiter = formulation.reconstruction.name
            least = 0.0
            if formulation.corrected_variant:
                order = min(cloud.order[a], cloud.order[b])
                impedance = 0.5 * (cloud.rho[a] * cloud.c_l[a] + cloud.rho[b] * cloud.c_l[b])
                closing = max(
                    (cloud.u[a] - cloud.u[b]) @ e, abs(e @ (pairs.stress[b] - pairs.stress[a]) @ e) / impedance
                )
                calm = max(1.0 - closing * (cloud.rho[a] + cloud.rho[b]) / (FRONT * impedance), 0.0)
                least = calm * MIN_LIMITER * (1.0 + max(order, 0.0))
                if formulation.adjoint:
                    least = (1.0 - elastic) * calm * MIN_LIMITER
            ua = ua + 0.5 * limited(limiter, for_u, 2 * part @ grad_u[a] @ x_ba - for_u, least)
            ub = ub - 0.5 * limited(limiter, for_u, 2 * part @ grad_u[b] @ x_ba - for_u, least)
            ta = ta + 0.5 * limited(limiter, for_t, 2 * part @ (grad_s[a] @ x_ba) @ e - for_t, least)
            tb = tb - 0.5 * limited(limiter, for_t, 2 * part @ (grad_s[b] @ x_ba) @ e - for_t, least)
        sides[name] = ua, ub, ta, tb
    u_own, u_its, traction = np.zeros(pairs.dim), np.zeros(pairs.dim), np.zeros(pairs.dim)
    slipped, exchanged, conducted, counts = 0.0, 0.0, 0.0, 1.0
    for name, (ua, ub, ta, tb) in sides.items():
        speed = cloud.c_l if name == "normal" else cloud.c_t
        za, zb = cloud.rho[a] * speed[a], cloud.rho[b] * speed[b]
        if formulation.corrected_variant and name == "normal":
            closing = SHOCK_SLOPE * max((ua - ub) @ e, 0.0)
            za, zb = za + cloud.rho[a] * closing, zb + cloud.rho[b] * closing
            if not has_contact:
                conducted = 0.25 * (cloud.rho[a] + cloud.rho[b]) * closing * (cloud.heat[b] - cloud.heat[a])
        t = (zb * ta + za * tb + za * zb * (ub - ua)) / (za + zb)
        common = (za * ua + zb * ub + tb - ta) / (za + zb)
        part = along if name == "normal" else np.eye(pairs.dim) - along
        pushed = za * zb / (za + zb) * (ub - ua) if name == "normal" else 0.0
        t = (1.0 - elastic) * t + elastic * (part @ mean + pushed)
        common = (1.0 - elastic) * common + elastic * part @ (cloud.u[a] + cloud.u[b]) / 2.0
        if name == "normal":
            pull = t @ e
            if formulation.corrected_variant:
                pull = min(pull, grows * min(cloud.bear[a], cloud.bear[b]))
            if formulation.corrected_variant and formulation.tension_stabilized:
                nearer = pairs.volume[a] * pairs.volume[b] / r ** (2 * pairs.dim)
                order = min(cloud.order[a], cloud.order[b])
                pull -= max(pull, 0.0) * order * min(TENSION_GAIN * max(nearer - 1.0, 0.0), 1.0)
            if not has_contact:
                stiffness = (za + zb) ** 2 / (cloud.rho[a] + cloud.rho[b])
                strain, most = max(-pull, 0.0) / (FRONT * stiffness), 0.5
                if formulation.smoothing.variable:
                    shrunk = 0.5 * (cloud.compression[a] + cloud.compression[b])
                    strain, most = max(strain, 0.5 * shrunk / FRONT), 1.0
                counted = min(strain**2, most)
                exchanged = counted * (0.5 * (cloud.u[a] + cloud.u[b]) - common) @ e
            if has_contact and formulation.smoothing.variable and pull < 0.0:
                borne = max(-max(ta @ e, tb @ e), 0.0)
                gap_factor = max(gap_factor, min(borne / (PRESSED * -pull), 1.0))
            if has_contact:
                pull, counts = gap_factor * min(pull, 0.0), 2.0 * zb / (za + zb)
            t, push = pull * e, -pull
        else:
            most = grows * min(cloud.shear[a], cloud.shear[b]) if formulation.corrected_variant else np.inf
            if has_contact:
                most = min(most, formulation.friction * push)
            size = np.linalg.norm(t)
            t = t * min(1.0, most / size) if size > 0.0 else t
        if name == "tangential":  # what bears no shear has no say
            za, zb = (
                (z * z + SHEAR_IMPEDANCE_MIN * (cloud.rho[i] * cloud.c_l[i]) ** 2) / z for z, i in ((za, a), (zb, b))
            )
        own, its = (ua + (t - ta) / za, ub - (t - tb) / zb) if has_contact else (common, common)
        u_own, u_its, traction = u_own + own, u_its + its, traction + t
        slipped = 0.5 * t @ (its - own)  # of the last, tangential part
    if pairs.dim == 1:
        slipped = 0.0
    heat = 0.5 * traction @ (u_its - u_own)
    if has_contact:
        heat, slipped, traction = grows * heat, grows * slipped, grows * traction
    elif formulation.adjoint:  # each side has the work of its own traction
        apart = (pairs.stress[a] @ pairs.operator[a] - pairs.stress[b] @ pairs.operator[b]) @ e
        heat += 0.25 * elastic * apart @ (cloud.u[b] - cloud.u[a])
    return u_own, traction, e, slope, gap_factor, heat, slipped, x_ba, exchanged, conducted, counts


def correctable(moment):
    """Return whether the neighbourhood tells all of a gradient."""
    dim = len(moment)
    return np.linalg.det(moment) > CORRECTABLE_MIN**dim


def at_edges(gradient, rate, moment, calm, bear):
    """Return velocity gradient and rate of volume, corrected where the neighbourhood is open."""
    if not (bear > 0.0 and correctable(moment)):
        return gradient, rate
    w = np.clip((0.95 - np.linalg.det(moment)) / 0.2, 0.0, 1.0) * calm
    gradient = gradient @ (np.eye(len(moment)) + w * (np.linalg.inv(moment) - np.eye(len(moment))))
    return gradient, (1.0 - w) * rate + w * np.trace(gradient)


def riemann_rates(cloud, formulation, neighbours, singular):
    """Return rows of rates of the contact law, laid out as the compiled ones."""
    pairs, dim, n = Pairs(cloud, formulation, neighbours), cloud.dim, len(cloud.x)
    volume, kernel, following = pairs.volume, formulation.kernel, formulation.smoothing.variable
    grad_u = np.array([pairs.gradient(a, cloud.u, singular) for a in range(n)])
    grad_s = np.array([pairs.gradient(a, cloud.stress, singular) for a in range(n)])
    if formulation.corrected_variant:  # what has failed has no slopes
        grad_u[cloud.order < 0.0] = grad_s[cloud.order < 0.0] = 0.0
    pairs.stress = cloud.stress
    if formulation.adjoint:
        pairs.operator, pairs.elastic, pairs.stress = operators(pairs, grad_u)
    rows = []
    for a in range(n):
        acceleration, power, gradient, slip, mu = np.zeros(dim), 0.0, np.zeros((dim, dim)), 0.0, 0.0
        rate, away, moment = 0.0, 0.0, np.zeros((dim, dim))
        h, spin, own = cloud.h[a], np.zeros(cloud.twist.shape[1]), np.zeros((dim, dim))
        unit = kernel.norm(dim) / h**dim
        density, slopes = unit * kernel.shape.py_func(0.0), 0.0  # number density, and the sum of q dW/dq
        for b in pairs.near[a]:
            u_star, t_star, e, slope, gap_factor, heat, slipped, x_ba, exchanged, conducted, counts = contact(
                pairs, grad_u, grad_s, a, b
            )
            heat += conducted
            r = np.linalg.norm(x_ba)
            if formulation.angular_momentum:
                share = 2.0 * volume[a] * volume[b] * slope / cloud.m[a]
                spin -= 0.5 * share * torque(x_ba, t_star)
                if not pairs.has_contact(a, b):  # each makes what its own twist takes back, and that alone is its work
                    spin -= 0.5 * share * torque(x_ba, about(cloud.twist[a], e))
                    acceleration += share * about(0.5 * (cloud.twist[a] + cloud.twist[b]), e)
                    heat += about(0.5 * cloud.twist[a], e) @ (cloud.u[b] - cloud.u[a])
                    own += volume[b] * slope * (x_ba @ e) * np.outer(e, e)
            force = 2.0 * volume[a] * volume[b] * slope * t_star
            acceleration += force / cloud.m[a]
            power += (force @ (u_star - cloud.u[a]) + 2.0 * volume[a] * volume[b] * slope * heat) / cloud.m[a]
            slip += 2.0 * volume[a] * volume[b] * slope * slipped / cloud.m[a]
            mu = max(mu, (cloud.u[a] - cloud.u[b]) @ x_ba / r)
            weight = gap_factor if pairs.has_contact(a, b) else 1.0
            crowd = 1.0
            if formulation.unequal_spacings and pairs.has_contact(a, b):
                weight *= pairs.along_normal(a, b) * h
                crowd = (cloud.h[b] / h) ** dim
            if following and pairs.has_contact(a, b):
                crowd = volume[b] / volume[a]
            strain = weight * 2.0 * slope * np.outer(u_star - cloud.u[a], e)
            gradient += volume[b] * strain
            rate += volume[a] * (crowd * np.trace(strain) + 2.0 * slope * exchanged)
            away += weight * crowd * slope * counts * (cloud.u[b] - cloud.u[a]) @ e
            moment += weight * volume[b] * slope * (x_ba @ e) * np.outer(e, e)
            if following:
                receding = 0.0 if pairs.has_contact(a, b) else (cloud.u[b] - cloud.u[a]) @ e
                q = r / h
                rate -= volume[a] * slope * receding + volume[a] * unit / h * kernel.slope.py_func(q) * receding
                density += weight * crowd * unit * kernel.shape.py_func(q)
                slopes += weight * crowd * unit * q * kernel.slope.py_func(q)
        further = []
        if formulation.corrected_variant:
            omega = max(1.0 - cloud.grows[a] * (1.0 + slopes / (dim * density)), 0.1)
            rate = rate / (omega * max(volume[a] * density, 1.0)) if following else rate
            calm = max(0.0, 1.0 - 20.0 * mu / cloud.c_l[a])
            leaves = 0.0 if following else calm * cloud.leaves[a]
            leading = cloud.counts[a] * away - rate - calm * cloud.fades[a]
            plain = gradient
            gradient, rate = at_edges(gradient, rate, moment, calm, cloud.bear[a])
            if formulation.adjoint:
                share = pairs.elastic[a]
                gradient = plain @ pairs.operator[a] + (1.0 - share) * (gradient - plain)
                rate, leaves = (1.0 - share) * rate + share * np.trace(gradient), (1.0 - share) * leaves
            further = [np.trace(gradient) - rate - leaves] + [leading] * formulation.corrects_density
        if formulation.has_contact:
            further = [*further, *[0.0] * (2 - len(further)), slip]
        if formulation.angular_momentum:
            mean = np.trace(own) / dim
            gain = mean + np.sqrt(((own - mean * np.eye(dim)) ** 2).sum() / 6.0)
            spin = spin / gain if gain > TORQUE_GAIN_MAX else spin
            ordered = cloud.order[a] > 0.0 and np.trace(moment) > SINGULAR * dim
            if not (ordered or correctable(moment)):
                spin = -2.0 * volume[a] / cloud.m[a] * cloud.twist[a]
            further = [*further, *[0.0] * (3 - len(further)), *spin]
        if formulation.adjoint:
            further = [*further, *[0.0] * (3 + dim * (dim - 1) // 2 - len(further)), *grad_u[a].ravel()]
        rows.append([*acceleration, power, mu, *gradient.ravel(), *further])
    return np.array(rows)
