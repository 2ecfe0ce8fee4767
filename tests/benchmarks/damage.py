"""placeholder"""


def run(x): ...
