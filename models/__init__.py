"""What is trained: data, networks, training, export, certificates."""
