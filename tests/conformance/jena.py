# SPDX-License-Identifier: Apache-2.0
"""Apache Jena, as Debian has it, for programs in one file of Java."""

import os
import pathlib
import shutil
import sys
import zipfile

JARS = ("jena-shacl jena-arq jena-core jena-base jena-iri slf4j-api slf4j-nop commons-lang3 commons-io commons-csv commons-codec commons-compress "
        "dexx.collection thrift protobuf gson guava").split()


def command(program, folder):
    """What runs a program that stands beside this file; FOLDER is for files that Java finds there. Without Jena or Java the test ends with 77."""
    jars = [f"/usr/share/java/{jar}.jar" for jar in JARS]
    if not shutil.which("javac") or not all(map(os.path.exists, jars)):
        print("skipped: Apache Jena or a Java compiler is not installed (Debian: libapache-jena-java, default-jdk-headless)")
        sys.exit(77)
    # Debian's Jena 4.5.0 does not find its own messages, without which it has no datatypes: its classes have another package than their resources.
    renamed = "org/apache/jena/ext/"
    with zipfile.ZipFile(jars[JARS.index("jena-core")]) as jar:
        for name in jar.namelist():
            if name.startswith(renamed) and name.endswith(".properties"):
                path = folder / "jena" / name[len(renamed):]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(jar.read(name))
    source = pathlib.Path(__file__).resolve().parent / program
    return ["java", "-XX:+UseSerialGC", "-cp", ":".join([str(folder / "jena"), *jars]), str(source)]
