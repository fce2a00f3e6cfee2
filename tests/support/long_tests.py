"""Names to the build system, while it collects, the tests that are marked as long: cmake's function
swarmtalk_pytest loads this plugin and gives each of them the label "long"."""


def pytest_collection_finish(session):
    for item in session.items:
        if item.get_closest_marker("long"):
            print(f"long: {item.nodeid}")
