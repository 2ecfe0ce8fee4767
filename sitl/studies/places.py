"""Where a campaign's work is done: on this machine or on a cluster."""

import argparse

from sitl.studies.campaign import Executor, local_executor
from sitl.studies.cluster import Cluster


def executor_of(options: argparse.Namespace) -> Executor:
    """As --cluster or --jobs say."""
    return Cluster(options.cluster) if options.cluster else local_executor(options.jobs)
