"""What the server's image leaves out, the server never asks for."""

import grimp


def test_nothing_that_the_server_does_leads_to_the_simulators_compiler() -> None:
    """Every import counts, at the top of a module or within a function, but those behind modules that a server cannot load:
    what imports torch, which is not installed there, and the commands of `workers.cli`.
    """
    graph = grimp.build_graph("server", "workers", "sim", include_external_packages=True)
    left_out = {"numba", "llvmlite"}
    assert left_out <= graph.modules
    behind = graph.find_modules_that_directly_import("torch") | {"workers.cli"}
    assert "workers.networks.modules" in behind
    for module in behind:
        graph.remove_module(module)
    for package in left_out:
        chains = graph.find_shortest_chains(importer="server", imported=package)
        assert not chains, next(iter(chains))
