"""Prediction errors: a Kalman filter takes up what the equations do not know."""
