"""The torch's pose in the weld frame from travel, work and spin angle, in CasADi, for angles that are variables."""

import casadi as ca

from nlpweld.kinematics.chain import Frame

TINY = 1e-24  # squared length under which a direction is taken as undefined


def torch_height_squared(travel: ca.SX, work: ca.SX) -> ca.SX:
    """Return 1 - cos^2 travel - cos^2 work, which a torch direction with both angles needs to be at least 0."""
    return -ca.cos(travel + work) * ca.cos(travel - work)


def torch_rotation(travel: ca.SX, work: ca.SX, spin: ca.SX) -> ca.SX:
    """Return R_p_H = Ry(phi) Rx(eta) Rz(spin), shape (3, 3) (Zhang et al., eq. 4), without arcsine or atan2.

    Where no direction has both angles the torch is laid on the surface, so that graphs stay finite; constrain
    :func:`torch_height_squared`. Its derivative by travel or work is unbounded where that reaches 0.

    Args:
        travel: from the root axis x to z_H, in (0, pi) [rad].
        work: from y to z_H, counted negative, in (-pi, 0) [rad].
        spin: about z_H [rad].
    """
    along, up = ca.cos(travel), ca.sqrt(ca.fmax(torch_height_squared(travel, work), TINY))
    across = ca.sqrt(along**2 + up**2)  # at least the root of TINY
    c_phi, s_phi = up / across, along / across
    c_eta, s_eta = -ca.sin(work), -ca.cos(work)
    tilt = ca.vertcat(
        ca.horzcat(c_phi, s_phi * s_eta, s_phi * c_eta),
        ca.horzcat(0, c_eta, -s_eta),
        ca.horzcat(-s_phi, c_phi * s_eta, c_phi * c_eta),
    )
    c, s = ca.cos(spin), ca.sin(spin)
    return tilt @ ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))


def torch_frame(travel: ca.SX, work: ca.SX, spin: ca.SX, stand_off_m: float | ca.SX) -> Frame:
    """Return T_p_H, the torch's end at ``stand_off_m * z_H`` from the weld point; see :func:`torch_rotation`."""
    R = torch_rotation(travel, work, spin)
    return Frame(R, stand_off_m * R[:, 2])
