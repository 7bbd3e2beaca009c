"""The extended Kalman filter of the joint filter: prediction, correction, retraction."""
