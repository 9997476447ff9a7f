import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlpweld.geometry.seam import weld_frames
from nlpweld.geometry.weld_angles import weld_rotations
from nlpweld.timing.frames import seam_frames

BLEND_M = 0.01


def test_a_blend_turns_twice_smoothly_where_the_seam_does_not(trough):
    blended = seam_frames(trough.cell, "main", BLEND_M)
    assert len(blended.kinks) == 2
    assert not any(kink.corner for kink in blended.kinks)
    kink = blended.kinks[0]
    s = kink.s + np.linspace(-2, 2, 4001) * kink.half
    step = s[1] - s[0]

    def bends(R: np.ndarray) -> np.ndarray:
        rates = Rotation.from_matrix(R[:-1].swapaxes(1, 2) @ R[1:]).as_rotvec() / step
        return np.abs(np.diff(rates, axis=0)).max(axis=1)

    as_it_is = weld_rotations(weld_frames(trough.cell, s))
    assert bends(as_it_is).max() > 2.0  # one sudden change of the turning rate
    assert bends(blended.rotations(s)).max() < 0.02  # made of many small ones
    off = Rotation.from_matrix(as_it_is.swapaxes(1, 2) @ blended.rotations(s)).magnitude()
    assert off[np.abs(s - kink.s) > kink.half].max() < 1e-12
    assert 0.1 < np.degrees(off.max()) < 1.0


def test_a_circle_has_a_break_and_no_kink(flange):
    assert seam_frames(flange.cell, "main", BLEND_M).kinks == ()


def test_a_corner_is_one(flange):
    turned = {
        "curve": "composite", "points": 18, "start_m": (0.0, 0.0, 0.0), "side": (0.0, 0.0, 1.0), "lean_deg": 135.0,
        "pieces": [{"kind": "line", "to_m": (0.1, 0.0, 0.0)}, {"kind": "line", "to_m": (0.1, 0.1, 0.0)}],
        "closed": False, "source": "a test",
    }  # fmt: skip
    cell = flange.cell.model_copy(update={"seam": type(flange.cell.seam).model_validate(turned)})
    (kink,) = seam_frames(cell, "main", BLEND_M).kinks
    assert kink.corner
    assert kink.s == pytest.approx(0.5)
