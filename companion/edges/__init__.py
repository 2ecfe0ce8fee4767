"""The only part that touches sockets, buses, files and clocks."""
