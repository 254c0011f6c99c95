# SPDX-License-Identifier: Apache-2.0
"""Headers are generated of live robots and of files, compile with two compilers, and drive a robot.

  generate_test.py SOURCE_DIR INCLUDE_DIRS... -- GENERATE_HEADER DRIVE_BAXTER BAXTER ROBOT...
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
import robot_process  # noqa: E402

FLAGS = ["-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-Wshadow"]

HOSTILE = """
@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .
@prefix dcterms: <http://purl.org/dc/terms/> . @prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix qudt: <http://qudt.org/schema/qudt/> .
@prefix http-core: <http://www.w3.org/2011/http#> . @prefix http-methods: <http://www.w3.org/2011/http-methods#> .
<t> a hybrit:RoboticThing , ex:class ; dcterms:title "*/ int x; /* ??/\\n#error out\\n \\\\ \\u202E evil\\" \\u2028" ; hybrit:blueprint <b> ;
  hybrit:property <t/class> , <t/thing> , <t/NULL> , <t/1st> , <t/a.b> , <t/a-b> , <t/%C3%A4> , <t/unknown> ; hybrit:action <t/actions/of> , <t/actions/delete> ;
  ex:class <t/class> ; ex:thing <t/thing> ; ex:null <t/NULL> ; ex:first <t/1st> ; ex:ab <t/a.b> ; ex:ab2 <t/a-b> ; ex:umlaut <t/%C3%A4> .
<t/class> dcterms:title "LONG" ; hybrit:binding [ http-core:mthd http-methods:PUT ] .
<t/actions/of> a hybrit:Action ; hybrit:consumes <record> ; hybrit:produces <record> . <t/actions/delete> a hybrit:Action ; hybrit:produces <numbers> .
<b> sh:property [ sh:path ex:class ; sh:node <record> ] , [ sh:path ex:thing ; sh:node <enumeration> ] , [ sh:path ex:null ; sh:node <empty> ] ,
  [ sh:path ex:first ; sh:node <numbers> ] , [ sh:path ex:ab ; sh:node <dates> ] , [ sh:path ex:ab2 ; sh:node <decimal> ] , [ sh:path ex:umlaut ; sh:node <unit> ] .
<record> sh:class ex:class , ex:virtual ; sh:property [ sh:path ex:class ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:integer ; sh:minInclusive -99999999999999999999 ] ,
  [ sh:path <http://other.example/ns#class> ; sh:maxCount 1 ; sh:datatype xsd:double ] , [ sh:path ex:Class ; sh:maxCount 1 ; sh:datatype xsd:byte ; sh:maxInclusive 7.5 ] ,
  [ sh:path ex:EOF ; sh:minCount 1 ; sh:maxCount 1 ; sh:node <bare> ] , [ sh:path <http://other.example/?a=%22b%22/?%3F/> ; sh:maxCount 1 ; sh:datatype xsd:anyURI ] ,
  [ sh:path ex:when ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:dateTime ] , [ sh:path ex:span ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:dayTimeDuration ] ,
  [ sh:path ex:huge ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ; sh:maxInclusive 123456789012345678901234567890 ] ,
  [ sh:path ex:matrix ; sh:minCount 1 ; sh:maxCount 1 ; sh:property [ sh:path ( [ sh:zeroOrMorePath rdf:rest ] rdf:first ) ;
    sh:property [ sh:path ( [ sh:zeroOrMorePath rdf:rest ] rdf:first ) ; sh:datatype xsd:unsignedByte ] ] ] .
<bare> sh:property [ sh:path ex:x ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:boolean ] .
<empty> sh:class ex:class ; sh:property [ sh:path ex:link ; sh:maxCount 1 ; sh:class ex:A ] .
<enumeration> sh:property [ sh:path rdf:value ; sh:minCount 1 ; sh:maxCount 1 ; sh:in ( "class" "Class" "CLASS" "" " " "*/" "a\\nb" "\\"" "\\\\" "??/" "??=" "1" "\\u4E2D" "\\u202E" "if" "NAN" "x\\u0007" ) ] .
<numbers> sh:property [ sh:path rdf:value ; sh:maxCount 1 ; sh:property [ sh:path ( [ sh:zeroOrMorePath rdf:rest ] rdf:first ) ; sh:datatype xsd:nonNegativeInteger ] ] .
<dates> sh:property [ sh:path rdf:value ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:date ] .
<decimal> sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:decimal ] .
<unit> sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:float ] , [ sh:path qudt:hasUnit ; sh:hasValue <http://other.example/?%22*/> ] .
"""


def run(arguments, **more):
    done = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, **more)
    assert done.returncode == 0, f"{' '.join(arguments)}:\n{done.stdout}{done.stderr}"
    return done.stdout


class Headers:
    def __init__(self, folder, include):
        self.folder = folder
        self.include = [f"-I{i}" for i in include]
        self.compilers = [c for c in ("g++", "clang++") if shutil.which(c)]
        assert self.compilers, "no compiler"

    def compile(self, header):
        source = header + ".cpp"
        with open(source, "w", encoding="utf-8") as file:
            file.write(f'#include "{header}"\n#include "{header}"\nint main() {{}}\n')
        for compiler in self.compilers:
            run([compiler, *FLAGS, *self.include, source])

    def generate(self, tool, source, namespace):
        header = os.path.join(self.folder, namespace.replace("::", "_") + ".hpp")
        graph = header + ".ttl"
        run([tool, source, namespace, header, graph])
        again = header + ".again"
        run([tool, graph, namespace, again])
        with open(header, "rb") as one, open(again, "rb") as two:
            assert one.read() == two.read(), f"{namespace}: the header of the file differs from that of the robot"
        run([tool, "--check", source, header])
        self.compile(header)
        return header


class Lesson(robot_process.Program):
    ends_with = (-signal.SIGTERM,)  # a lesson has no handler

    def __init__(self, path):
        super().__init__(path, "--serve", "0")


def start(program):
    name = os.path.basename(program)
    return Lesson(program) if name[0] == "t" and name[1].isdigit() else robot_process.Program(program, "--port", "0")


def main():
    split = sys.argv.index("--")
    source_dir, *include = sys.argv[1:split]
    tool, drive, baxter, *robots = sys.argv[split + 1:]
    with tempfile.TemporaryDirectory() as folder:
        headers = Headers(folder, include)
        with start(baxter) as robot:
            header = headers.generate(tool, robot.url, "baxter")
            golden = os.path.join(source_dir, "tests", "codegen", "baxter.hpp")
            with open(header, encoding="utf-8") as one, open(golden, encoding="utf-8") as two:
                assert one.read() == two.read(), f"{header} differs from {golden}: if that is meant, copy it"
            assert run([drive, robot.url]) == "the arm has moved\n"
            for program in robots:
                with start(program) as second:
                    print(program, flush=True)
                    headers.generate(tool, second.url, "acme::" + os.path.basename(program))
                    checked = subprocess.run([tool, "--check", second.url, header], stdout=subprocess.PIPE, universal_newlines=True, check=False)
                    assert checked.returncode == 1 and "RevoluteJoint: the robot does not have it any more\n" in checked.stdout, checked

        hostile = os.path.join(folder, "hostile.ttl")
        with open(hostile, "w", encoding="utf-8") as file:
            file.write(HOSTILE.replace("LONG", "x*/" * 33_333))
        for namespace in ("robot", "client", "rdf"):  # lrt has namespaces of these names
            headers.generate(tool, hostile, namespace)

        suite = os.path.join(source_dir, "..", "shared", "suites", "shacl")
        count = 0
        for path, _, files in os.walk(suite):
            for name in sorted(files):
                if name.endswith(".ttl") and name.startswith(("shacl-shacl", "complex", "personexample", "node-001", "property-001", "and-001", "or-001")):
                    made = subprocess.run([tool, os.path.join(path, name), "suite", os.path.join(folder, "suite.hpp")], stderr=subprocess.PIPE, check=False)
                    if made.returncode == 0:
                        headers.compile(os.path.join(folder, "suite.hpp"))
                        count += 1
        if os.path.isdir(suite):
            assert count > 2, count
        else:
            print("the shapes of the W3C are left out: there is no", suite)
    print("headers compile and drive a robot")


if __name__ == "__main__":
    main()
