// SPDX-License-Identifier: Apache-2.0
#include "src/urdf/packages.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <lrt/urdf.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

void write(const std::string& file, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(file).parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// A folder with a package, and a secret beside it.
struct Package {
  Package() {
    write(folder / "arm/meshes/hand.STL", "solid hand");
    write(folder / "arm/meshes/a b%.dae", "<COLLADA/>");
    write(folder / "arm/big.obj", std::string(1001, 'v'));
    write(folder / "arm/cloud.ply", "ply");
    write(folder / "secret.stl", "secret");
    std::filesystem::create_symlink(folder / "secret.stl", folder / "arm/leak.stl");
    std::filesystem::create_directory_symlink(folder.path(), folder / "arm/up");
    std::filesystem::create_symlink(folder / "arm/meshes/hand.STL", folder / "arm/inside.stl");
    std::filesystem::create_directory(folder / "arm_2");
    write(folder / "arm_2/x.stl", "x");
    std::filesystem::create_symlink(folder / "arm_2/x.stl", folder / "arm/sibling.stl");
    options.folders = {{"arm", folder / "arm"}, {"gone", folder / "gone"}};
    options.max_bytes = 1000;
  }
  Errc error_of(const std::string& iri) const {
    const auto found = urdf::find_file(iri, options);
    return found ? Errc{255} : found.error().code;
  }
  Folder folder;
  urdf::PackageOptions options;
};

/// A robot whose links have these meshes.
urdf::Robot robot_with(const std::vector<std::string>& meshes) {
  std::string text = "<robot name='r'><link name='root'>";
  for (const std::string& mesh : meshes) text += "<visual><geometry><mesh filename='" + mesh + "'/></geometry></visual>";
  return urdf::Robot(urdf::parse(text + "</link></robot>").value());
}

}  // namespace

TEST_CASE("only files below the folder of a package are found", "[urdf]") {
  const Package p;
  const auto found = urdf::find_file("package://arm/meshes/hand.STL", p.options);
  REQUIRE(found);
  CHECK(found->name == "meshes/hand.STL");
  CHECK(found->media_type == "model/stl");
  CHECK(urdf::find_file("package://arm/meshes/a%20b%25.dae", p.options)->media_type == "model/vnd.collada+xml");
  CHECK(urdf::find_file("package://arm/meshes/a b%.dae", p.options)->name == "meshes/a b%.dae");
  CHECK(urdf::find_file("package://arm/cloud.ply", p.options)->media_type == "application/octet-stream");
  CHECK(urdf::find_file("package://arm/inside.stl", p.options));
  CHECK(urdf::find_file("package://arm/meshes//hand.STL", p.options)->name == "meshes/hand.STL");
  for (const char* out :
       {"../secret.stl", "meshes/../../secret.stl", "%2e%2e/secret.stl", "..%2Fsecret.stl", "meshes/..%2f..%2fsecret.stl", "leak.stl",
        "up/secret.stl", "sibling.stl", "/etc/passwd", "%2Fetc/passwd", "meshes", "", "./cloud.ply", "meshes/", "a%00b", "%FF"}) {
    CAPTURE(out);
    CHECK(p.error_of(std::string("package://arm/") + out) == Errc::refused);
  }
  CHECK(p.error_of("package://arm") == Errc::refused);
  CHECK(p.error_of("package://arm/none.stl") == Errc::io_error);
  CHECK(p.error_of("package://gone/x.stl") == Errc::io_error);
  CHECK(p.error_of("package://arm/big.obj") == Errc::limit_exceeded);
  CHECK(p.error_of("package://other/x.stl") == Errc::unknown_path);
  CHECK(p.error_of("package://") == Errc::unknown_path);
  CHECK(p.error_of("file:///etc/passwd") == Errc::unknown_path);
  CHECK(p.error_of("meshes/hand.STL") == Errc::unknown_path);
}

TEST_CASE("a robot's meshes are served with their types, and the description keeps the IRI of the document", "[urdf]") {
  Package p;
  urdf::Robot robot = robot_with({"package://arm/meshes/hand.STL", "package://arm/meshes/a%20b%25.dae", "package://arm/meshes/hand.STL",
                                  "package://arm/../secret.stl", "package://arm/none.stl", "hand.stl"});
  const std::vector<std::string> warnings = robot.serve_meshes(p.options);
  REQUIRE(warnings.size() == 3);
  CHECK(warnings[0] == "mesh \"package://arm/../secret.stl\" is not served: its name contains \"..\"");
  CHECK(warnings[2] == "mesh \"hand.stl\" is not served: it is not a package:// IRI");
  Bench bench;
  REQUIRE(robot.add_to(bench.engine));
  const std::string root = "http://localhost", hand = "/r/meshes/arm/meshes/hand.STL";
  for (const char* shape : {"1", "3"})
    CHECK(missing(bench.get(std::string("/r/root/visual/") + shape), std::string("<r/root/visual/") + shape +
                                                                         "> lrt:mesh <package://arm/meshes/hand.STL> ; dcat:downloadURL <" +
                                                                         hand.substr(1) + "> .") == "");
  const rdf::Graph shapes = bench.get("/r/root/state").graph();
  const auto links = [&](const char* shape) {
    return shapes.objects(rdf::iri(root + "/r/root/visual/" + shape), rdf::TermView(vocab::dcat::downloadURL)).size();
  };
  CHECK(links("2") == 1);
  CHECK(links("4") + links("5") + links("6") == 0);

  const Answer bytes = bench.get(hand);
  CHECK(bytes.status == 200);
  CHECK(bytes.body == "solid hand");
  CHECK(bytes.field("Content-Type") == "model/stl");
  CHECK(bench.ask("GET " + hand + "\nIf-None-Match: " + bytes.field("ETag")).status == 304);
  const Answer part = bench.ask("GET " + hand + "\nRange: bytes=6-");
  CHECK(part.status == 206);
  CHECK(part.body == "hand");
  CHECK(bench.get("/r/meshes/arm/meshes/a%20b%25.dae").body == "<COLLADA/>");
  for (const char* out : {"/r/meshes/arm/cloud.ply", "/r/meshes/arm/none.stl", "/r/meshes/secret.stl", "/r/meshes/arm/up/secret.stl"})
    CHECK(bench.get(out).status == 404);
  CHECK(bench.get("/r/meshes/arm/..%2Fsecret.stl").status == 404);

  write(p.folder / "arm/meshes/hand.STL", "solid hand 2");  // another version
  std::filesystem::last_write_time(p.folder / "arm/meshes/hand.STL", std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  const Answer newer = bench.ask("GET " + hand + "\nIf-None-Match: " + bytes.field("ETag"));
  CHECK(newer.status == 200);
  CHECK(newer.body == "solid hand 2");
  std::filesystem::remove(p.folder / "arm/meshes/hand.STL");
  std::filesystem::create_symlink(p.folder / "secret.stl", p.folder / "arm/meshes/hand.STL");
  const Answer leak = bench.get(hand);
  CHECK(leak.status == 500);
  CHECK(leak.body.find("solid") == std::string::npos);
  std::filesystem::remove(p.folder / "arm/meshes/hand.STL");
  CHECK(bench.get(hand).status == 500);
}

TEST_CASE("a mesh is read when a client requests it, and where the robot's loop does not wait for it", "[urdf]") {
  Package p;
  urdf::Robot robot = robot_with({"package://arm/meshes/hand.STL"});
  CHECK(robot.serve_meshes(p.options).empty());
  Bench bench;
  REQUIRE(robot.add_to(bench.engine));
  (void)bench.get("/r/state");
  (void)bench.get("/r/root/state");
  (void)bench.get("/r/meshes");
  CHECK(bench.ask("GET /r/meshes/state\nAccept: application/json").body == "{}");
  const Bench::Sent sent = bench.send("GET /r/meshes/arm/meshes/hand.STL");
  CHECK_FALSE(bench.answer(sent));
  while (!bench.answer(sent)) {
    auto jobs = bench.take_jobs();
    REQUIRE_FALSE(jobs.empty());
    for (engine::Job& job : jobs) {
      CHECK(job.where == Dispatch::io_thread);
      job.run();
    }
  }
  CHECK(bench.answer(sent)->body == "solid hand");
}

TEST_CASE("a robot without packages has no meshes below it", "[urdf]") {
  urdf::Robot robot = robot_with({"package://arm/x.stl"});
  CHECK(robot.serve_meshes({}).size() == 1);
  Bench bench;
  REQUIRE(robot.add_to(bench.engine));
  CHECK(bench.get("/r/meshes").status == 404);
}
