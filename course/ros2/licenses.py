"""The licenses that `ros2 pkg create` knows, and their texts."""

from importlib import metadata
from pathlib import Path

# ament's identifiers, each with the file on Debian and Ubuntu that has the text, if there is one.
LICENSES = {
    "Apache-2.0": "Apache-2.0",
    "BSL-1.0": "",
    "BSD-2.0": "",
    "BSD-2-Clause": "",
    "BSD-3-Clause": "",
    "GPL-3.0-only": "GPL-3",
    "LGPL-3.0-only": "LGPL-3",
    "MIT": "",
    "MIT-0": "",
}
COMMON_LICENSES = Path("/usr/share/common-licenses")
GRANT = """\
Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
persons to whom the Software is furnished to do so"""
NOTICE = """\
, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the
Software"""
NO_WARRANTY = """\
.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
"""
BSD = """\
Redistribution and use in source and binary forms, with or without modification, are permitted provided that the
following conditions are met:

1. Redistributions of source code must retain the above copyright notice, this list of conditions and the following
   disclaimer.

2. Redistributions in binary form must reproduce the above copyright notice, this list of conditions and the following
   disclaimer in the documentation and/or other materials provided with the distribution.
"""
NO_ENDORSEMENT = """\

3. Neither the name of the copyright holder nor the names of its contributors may be used to endorse or promote products
   derived from this software without specific prior written permission.
"""
BSD_NO_WARRANTY = """\

THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND ANY EXPRESS OR IMPLIED WARRANTIES,
INCLUDING, BUT NOT LIMITED TO, THE IMPLIED WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE
DISCLAIMED. IN NO EVENT SHALL THE COPYRIGHT HOLDER OR CONTRIBUTORS BE LIABLE FOR ANY DIRECT, INDIRECT, INCIDENTAL,
SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES (INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR
SERVICES; LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND ON ANY THEORY OF LIABILITY,
WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT (INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF
THIS SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.
"""
TEXTS = {
    "MIT": GRANT + NOTICE + NO_WARRANTY,
    "MIT-0": GRANT + NO_WARRANTY,
    "BSD-2-Clause": BSD + BSD_NO_WARRANTY,
    "BSD-2.0": BSD + NO_ENDORSEMENT + BSD_NO_WARRANTY,
    "BSD-3-Clause": BSD + NO_ENDORSEMENT + BSD_NO_WARRANTY,
}


def license_text(identifier: str) -> str | None:
    """Return the text of one of LICENSES, or None if it is not on this machine."""
    if identifier in TEXTS:
        return TEXTS[identifier]
    file = COMMON_LICENSES / LICENSES[identifier]
    if file.is_file():
        return file.read_text(encoding="utf-8")
    if identifier == "Apache-2.0":  # the course's own license
        return metadata.distribution("ros2-course").read_text("licenses/LICENSE")
    return None
