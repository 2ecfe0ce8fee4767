"""Obstacle models: where each ship can be by now."""
