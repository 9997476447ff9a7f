"""Kinematics of serial chains in CasADi: forward, Jacobian, closed-form inverse, manipulability."""
