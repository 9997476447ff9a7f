"""The torch's graph against its NumPy twin."""

import casadi as ca
import numpy as np
import pytest

from nlpweld.geometry import torch_angles
from nlpweld.kinematics.torch import torch_frame, torch_height_squared

ANGLES = [ca.SX.sym(name) for name in ("travel", "work", "spin")]
STAND_OFF_M = 0.02


def evaluated(travel: np.ndarray, work: np.ndarray, spin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rotations (M, 3, 3) and origins (M, 3) of the graph."""
    frame = torch_frame(*ANGLES, STAND_OFF_M)
    R, p = ca.Function("torch", ANGLES, [ca.densify(frame.R), frame.p]).map(len(travel))(travel[None], work, spin)
    return np.array(R).reshape(3, -1, 3).transpose(1, 0, 2), np.array(p).T


def draws() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return 5000 feasible torches."""
    travel, share, spin = np.random.default_rng(1).uniform([[0.05], [1e-6], [-np.pi]], [[3.1], [1], [np.pi]], (3, 5000))
    half = np.minimum(travel, np.pi - travel)
    return travel, -(np.pi / 2 + (2 * share - 1) * half), spin


def test_graph_gives_the_pose_of_the_arrays() -> None:
    torches = draws()
    R, p = evaluated(*torches)
    T = torch_angles.torch_pose(*torches, STAND_OFF_M)
    assert np.abs(R - T[:, :3, :3]).max() < 1e-13
    assert np.abs(p - T[:, :3, 3]).max() < 1e-15


def test_height_is_that_of_the_arrays() -> None:
    travel, work, _ = draws()
    height = ca.Function("height", ANGLES[:2], [torch_height_squared(*ANGLES[:2])])
    found = np.array(height.map(len(travel))(travel[None], work)).ravel()
    assert found == pytest.approx(torch_angles.height_squared(travel, work), abs=1e-15)


def test_graph_stays_finite_with_its_derivative_where_no_direction_has_both_angles() -> None:
    R = torch_frame(*ANGLES, STAND_OFF_M).R
    slopes = ca.Function("slopes", ANGLES, [R, ca.jacobian(ca.vec(R), ca.vertcat(*ANGLES))])
    for angles in ((0.3, -0.3, 0.1), (np.pi / 2, 0.0, 0.1), (0.3, 0.3 - np.pi / 2, 0.1)):
        for value in slopes(*angles):
            assert np.isfinite(np.array(value)).all()


def test_derivative_by_travel_and_spin_is_that_of_differences() -> None:
    R = torch_frame(*ANGLES, STAND_OFF_M).R
    slope = ca.Function("slope", ANGLES, [ca.jacobian(ca.vec(R), ca.vertcat(*ANGLES))])
    at, step = np.array([1.2, -1.0, 0.4]), 1e-6
    for i in range(3):
        ahead, behind = (torch_angles.torch_rotation(*(at + sign * step * np.eye(3)[i])) for sign in (1, -1))
        found = np.array(slope(*at))[:, i]
        assert found == pytest.approx(((ahead - behind) / (2 * step)).ravel(order="F"), abs=1e-8)
