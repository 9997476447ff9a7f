"""The geometry process: reads capsules from stdin, writes their FCL distances to stdout.

It is a process of its own because FCL can hang or abort on geometry it dislikes; :mod:`nlpweld.verify.exact` watches
it. It imports NumPy, FCL and nothing else that takes time.
"""

import sys

import fcl
import numpy as np

from nlpweld.verify.pipe import receive, send


def distances(ends: np.ndarray, radii: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the FCL distance of every pair in every sample, shape (M, P) [m].

    Args:
        ends: axis ends of B capsules, shape (M, B, 2, 3) [m].
        radii: shape (B,) [m].
        pairs: two body indices a row, shape (P, 2).

    Returns:
        python-fcl's unsigned ``distance``, raw: -1 may mean that a pair penetrates by an unknown depth.
    """
    middle = ends.mean(axis=2)
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
    R = _rotations(ends, length)
    built = length[0].copy()
    bodies = [fcl.CollisionObject(fcl.Capsule(r, h)) for r, h in zip(radii, built, strict=True)]
    index = [(int(i), int(j)) for i, j in pairs]
    result = np.empty((len(ends), len(index)))
    for m in range(len(ends)):
        for b in range(len(bodies)):
            if abs(length[m, b] - built[b]) > 1e-12:  # a body between moving links changes its length
                built[b] = length[m, b]
                bodies[b] = fcl.CollisionObject(fcl.Capsule(radii[b], built[b]))
            bodies[b].setTransform(fcl.Transform(R[m, b], middle[m, b]))
        result[m] = [fcl.distance(bodies[i], bodies[j]) for i, j in index]
    return result


def _rotations(ends: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return frames whose z axis lies along each capsule (an FCL capsule's axis is z), shape (M, B, 3, 3)."""
    axis = np.where(length[..., None] > 0, ends[:, :, 1] - ends[:, :, 0], [0.0, 0.0, 1.0])
    z = axis / np.where(length > 0, length, 1.0)[..., None]
    helper = np.where(np.abs(z[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def main() -> None:
    """Answer requests (ends, radii, pairs) until stdin ends."""
    answers = sys.stdout.buffer
    sys.stdout = sys.stderr  # nothing that prints may reach the pipe of answers
    while True:
        try:
            ends, radii, pairs = receive(sys.stdin.buffer, 3)
        except EOFError:
            return
        send(answers, distances(ends, radii, pairs))


if __name__ == "__main__":
    main()
