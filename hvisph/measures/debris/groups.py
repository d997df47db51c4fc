"""Connected groups of particles."""

import numpy as np

from hvisph.output.snapshot import Snapshot

LINK = 2.0  # particles nearer than this many spacings belong together
NEAR = 1.3  # spacings within which nearly all neighbours of sound matter are linked already, at few pairs each
MOST_CELLS = 30_000_000  # above it the grid is not used
ALIKE = 1.2  # spacings of a body that differ by no more than this factor are one


class Neighbours:
    """Pairs that were neighbours in a run's first snapshot: most still are, and their search is most of the work."""

    def __init__(self, start: Snapshot, spacing: float):
        self._start, self._spacing = start, spacing
        self._pairs: dict[tuple[int, ...], np.ndarray] = {}

    def pairs(self, bodies: tuple[int, ...], number: np.ndarray) -> np.ndarray | None:
        """Return pairs of indices (m, 2) among particles of `bodies` with the numbers (n,); None where others began."""
        own = np.flatnonzero(np.isin(self._start.body, bodies))
        if not np.array_equal(self._start.id[own], number):
            return None
        if bodies not in self._pairs:
            self._pairs[bodies] = _near_pairs(self._start.fields["position"][own], NEAR * self._spacing)
        return self._pairs[bodies]


def connected_groups(
    position: np.ndarray, spacing: float | np.ndarray, link: float = LINK, likely: np.ndarray | None = None
) -> np.ndarray:
    """Return the number of the group that each particle (n,) belongs to, the largest group being 0.

    Groups are particles linked at `link` spacings; `spacing` is dx [m], or of every particle its own (n,), and two
    particles are linked by the mean of theirs. Groups are ordered by their number of particles, and by their first one
    where that is the same. `likely` are pairs of indices (m, 2), the lower first, that are probably near each other,
    such as the start's.
    """
    if len(position) == 0:
        return np.zeros(0, dtype=np.int64)
    position = position.reshape(len(position), -1)
    if isinstance(spacing, np.ndarray):
        return by_size(_graded_groups(position, spacing, link))
    # near particles are joined first; only those still apart need the search that yields many pairs
    near = min(link, NEAR) * spacing
    labels = _components_by_pairs(
        position, _near_pairs(position, near) if likely is None or link <= NEAR else likely, near
    )
    if link > NEAR:
        apart = np.flatnonzero(labels != np.bincount(labels).argmax())
        labels = _join_components(position, labels, apart, link * spacing)
    return by_size(labels)


def _near_pairs(position: np.ndarray, reach: float) -> np.ndarray:
    """Return the pairs of particles nearer than `reach` to each other, shape (m, 2)."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(position.reshape(len(position), -1)).query_pairs(reach, output_type="ndarray")
    return np.asarray(pairs.astype(np.int32))


def _components_by_pairs(position: np.ndarray, pairs: np.ndarray, reach: float) -> np.ndarray:
    """Return the connected components (n,) of the pairs that are nearer than `reach`; indices (m, 2), the lower first.

    One pair of each particle with an earlier one makes trees, whose roots are found by going to the parent's parent;
    of the others only those between two trees matter.
    """
    numbers = np.arange(len(position), dtype=np.int32)
    parent = numbers.copy()
    parent[pairs[:, 1]] = pairs[:, 0]
    child = np.flatnonzero(parent != numbers)
    links = _linked_pairs(position, np.column_stack([parent[child], child]), reach)
    parent = numbers.copy()
    parent[links[:, 1]] = links[:, 0]
    while not np.array_equal(further := parent[parent], parent):
        parent = further
    labels = (np.cumsum(parent == numbers) - 1)[parent]
    between = _linked_pairs(position, pairs[labels[pairs[:, 0]] != labels[pairs[:, 1]]], reach)
    return _components(int(labels.max()) + 1, labels[between[:, 0]], labels[between[:, 1]])[labels]


def _linked_pairs(position: np.ndarray, pairs: np.ndarray, reach: float) -> np.ndarray:
    """Return those of the pairs that are nearer than `reach` to each other."""
    apart = position[pairs[:, 0]]
    apart -= position[pairs[:, 1]]
    return np.asarray(pairs[np.einsum("ij,ij->i", apart, apart) <= reach * reach])


def _graded_groups(position: np.ndarray, spacing: np.ndarray, link: float) -> np.ndarray:
    """Return the connected components of particles of unlike `spacing` (n,) [m]."""
    count = len(position)
    labels = _components(count, *_pairs(position, spacing, np.arange(count), min(NEAR, link)))
    if link > NEAR:
        apart = np.flatnonzero(labels != np.bincount(labels).argmax())
        one, other = _pairs(position, spacing, apart, link)
        labels = _components(int(labels.max()) + 1, labels[one], labels[other])[labels]
    return labels


def _pairs(position: np.ndarray, spacing: np.ndarray, chosen: np.ndarray, link: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of the particles `chosen` with any, nearer than `link` times the mean of their spacings.

    They are sought by classes of like spacing, so that no coarse reach is searched among fine particles only.
    """
    from scipy.spatial import cKDTree

    classes = np.floor(np.log(spacing / spacing.min()) / np.log(ALIKE)).astype(np.int64)
    own, rows = classes[chosen], {k: np.flatnonzero(classes == k) for k in np.unique(classes)}
    trees = {k: cKDTree(position[members]) for k, members in rows.items()}
    kept_pairs: list[tuple[np.ndarray, np.ndarray]] = []
    for k in np.unique(own):
        mine = chosen[own == k]
        tree = cKDTree(position[mine])
        for other, members in rows.items():
            reach = 0.5 * link * float(spacing[mine].max() + spacing[members].max())
            near = tree.sparse_distance_matrix(trees[other], reach, output_type="ndarray")
            one, two = mine[near["i"]], members[near["j"]]
            kept = near["v"] <= 0.5 * link * (spacing[one] + spacing[two])
            kept_pairs.append((one[kept], two[kept]))
    if not kept_pairs:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    return np.concatenate([one for one, _ in kept_pairs]), np.concatenate([two for _, two in kept_pairs])


def _join_components(position: np.ndarray, labels: np.ndarray, apart: np.ndarray, reach: float) -> np.ndarray:
    """Return the components `labels` joined where particles of two are nearer than `reach`.

    Of any two, one at least is among the particles `apart`, which are not in the largest component.
    """
    from scipy.spatial import cKDTree

    if len(apart) == 0:
        return labels
    # slightly more than the reach: the pairs decide
    rows = np.flatnonzero(_may_reach(position, position[apart], reach * (1.0 + 1e-6)))
    near = cKDTree(position[apart]).query(position[rows], distance_upper_bound=reach * (1.0 + 1e-9))[0] < np.inf
    rows = rows[near]
    pairs = rows[cKDTree(position[rows]).query_pairs(reach, output_type="ndarray")]
    return _components(int(labels.max()) + 1, labels[pairs[:, 0]], labels[pairs[:, 1]])[labels]


def _may_reach(position: np.ndarray, others: np.ndarray, reach: float) -> np.ndarray:
    """Return whether points (n, dim) are in a cell of edge `reach` that holds one of others (m, dim), or beside one."""
    low = others.min(axis=0) - 2.0 * reach
    shape = np.ceil((others.max(axis=0) - low) / reach).astype(np.int64) + 2
    if np.prod(shape.astype(float)) > MOST_CELLS:
        return np.ones(len(position), dtype=bool)
    cells = np.zeros(shape, dtype=bool)
    cells[tuple(((others - low) / reach).astype(np.int64).T)] = True
    for axis in range(len(shape)):
        cells |= np.roll(cells, 1, axis) | np.roll(cells, -1, axis)  # what wraps round comes from empty borders
    place = np.floor((position - low) / reach).astype(np.int64)
    inside = ((place >= 0) & (place < shape)).all(axis=1)
    near = np.zeros(len(position), dtype=bool)
    near[inside] = cells[tuple(place[inside].T)]
    return near


def _components(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def by_size(labels: np.ndarray) -> np.ndarray:
    """Return the same groups numbered by their size, and where that is the same by their first particle."""
    sizes = np.bincount(labels)
    first = np.empty(len(sizes), dtype=np.int64)
    first[labels[::-1]] = np.arange(len(labels))[::-1]  # the last that is assigned remains
    rank = np.empty(len(sizes), dtype=np.int64)
    rank[np.lexsort((first, -sizes))] = np.arange(len(sizes))
    return rank[labels]


def main_body(position: np.ndarray, spacing: float | np.ndarray) -> np.ndarray:
    """Return the indices of the particles of the largest group linked at `LINK` spacings."""
    return np.flatnonzero(connected_groups(position, spacing) == 0)
