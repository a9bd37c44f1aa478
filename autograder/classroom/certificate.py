"""The HTTPS certificate of a class and its key: both are checked before anything is changed."""

import ssl
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509

from autograder.errors import UsageError
from course.foundation.times import MINUTES

SOON = timedelta(days=14)  # before a certificate expires, it should be renewed


def paths(certificate: Path | None, key: Path | None) -> tuple[str, str]:
    """Return the absolute paths of both, or two empty strings for none; raises UsageError if they are unusable."""
    if (certificate is None) != (key is None):
        raise UsageError("give --certificate and --key, or neither")
    for path in (certificate, key):
        if path and not path.is_file():
            raise UsageError(f"there is no file {path}")
    if not certificate or not key:
        return "", ""
    _load(certificate, key)
    return str(certificate.resolve()), str(key.resolve())


def check_covers(certificate: Path, host: str) -> None:
    """Raise UsageError unless a certificate covers a host name and its subdomains."""
    try:
        found = x509.load_pem_x509_certificates(certificate.read_bytes())[0]
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        known = {name.lower() for name in names.get_values_for_type(x509.DNSName)}
    except (OSError, ValueError, x509.ExtensionNotFound):
        known = set()
    if missing := [name for name in (host.lower(), f"*.{host.lower()}") if name not in known]:
        raise UsageError(f"{certificate} is not for {' and '.join(missing)}: --host needs one for the name and *.name")


def warning(certificate: str, now: datetime) -> str:
    """Return a warning about the certificate at this path, or about having none (path ''); '' when all is well."""
    if not certificate:
        return "Without a certificate: passwords and pages go over the network as they are."
    try:
        found = x509.load_pem_x509_certificates(Path(certificate).read_bytes())[0]  # its issuers' follow it
    except (OSError, ValueError):
        return f"The certificate {certificate} no longer exists or cannot be read."
    if now < found.not_valid_before_utc:
        return f"The certificate is not valid before {found.not_valid_before_utc:{MINUTES}} UTC: browsers warn."
    if now >= found.not_valid_after_utc:
        return f"The certificate expired on {found.not_valid_after_utc:%Y-%m-%d}: browsers warn. Renew it."
    if now >= found.not_valid_after_utc - SOON:
        return f"The certificate expires on {found.not_valid_after_utc:%Y-%m-%d}: renew it."
    return ""


def _load(certificate: Path, key: Path) -> None:
    """Load certificate and key, as the hub's proxy will; raises UsageError."""

    def locked() -> str:
        raise UsageError(f"{key} is protected by a password: write it without one, `openssl pkey -in {key} -out NEW`")

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    path = certificate
    try:
        context.load_verify_locations(path)
        path = key
        context.load_cert_chain(certificate, key, password=locked)
    except ssl.SSLError as error:
        if (error.reason or "").endswith("MISMATCH"):
            raise UsageError(f"{key} is not the key of {certificate}") from None
        what = "certificate" if path == certificate else "key"
        raise UsageError(f"{path} contains no {what}: a PEM file is needed") from None
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from None
