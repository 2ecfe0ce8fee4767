"""The bundled sea: vehicle, autopilot, ship traffic, and the links between them and the companion."""
