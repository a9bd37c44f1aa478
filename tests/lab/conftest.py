"""A kernel with a live session, which the tests of a file share, and a page that is connected to it."""

from collections.abc import Iterator

import pytest

from course.lab.kernel.start import SERVED
from tests.kernels import Kernel
from tests.lab.client import Client, page_of


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kernel]:
    """A kernel with a live session, in a folder of its own, as JupyterLab starts it."""
    kernel = Kernel(tmp_path_factory.mktemp("live"), {SERVED: "live.ipynb"})
    kernel.run("import course\nros = course.live()")
    yield kernel
    kernel.stop()


@pytest.fixture
def page(kernel: Kernel) -> Iterator[Client]:
    """A page that is connected to the kernel."""
    client = page_of(kernel)
    yield client
    client.close()
