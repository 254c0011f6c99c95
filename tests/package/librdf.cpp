// SPDX-License-Identifier: Apache-2.0
// A host of lrt::librdf: a model of Redland as a graph of a World.
#include <lrt/lrt.hpp>
#include <lrt/redland.hpp>

int main() {
  librdf_world* const redland = librdf_new_world();
  librdf_world_open(redland);
  librdf_storage* const storage = librdf_new_storage(redland, "memory", nullptr, nullptr);
  librdf_model* const tasks = librdf_new_model(redland, storage, nullptr);
  {
    lrt::Options options;
    options.listen.port = 0;
    lrt::Server server = lrt::Server::create(options).value();
    lrt::World world("world");
    lrt::redland::Model attached = lrt::redland::Model::attach(world, "tasks", tasks).value();
    server.add(std::move(world)).value();
    attached.changed();
    server.poll();
  }
  librdf_free_model(tasks);
  librdf_free_storage(storage);
  librdf_free_world(redland);
}
