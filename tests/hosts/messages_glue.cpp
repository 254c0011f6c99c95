// SPDX-License-Identifier: Apache-2.0
#include <lrt/lrt.hpp>

#include "tests/hosts/glue.hpp"
#include "tests/hosts/messages.hpp"

namespace cell {

LRT_RECORD(Vector3, x, y, z)
LRT_RECORD(Quaternion, x, y, z, w)
LRT_RECORD(Pose, position, orientation)
LRT_RECORD(MoveJ, joints, speed)
LRT_RECORD(MoveL, target, speed, blend)
LRT_RECORD(Wait, seconds)
LRT_RECORD(Step, name, what)
LRT_RECORD(Tool, name, mass, flange)
LRT_RECORD(Program, name, steps, tool)
LRT_RECORD(Status, mode, step, now, warnings)

inline void lrt_describe(lrt::rdf::Record<Vector3>& r) {
  for (const char* axis : {"x", "y", "z"}) r.facets(axis).unit(lrt::unit::metre);
}
inline void lrt_describe(lrt::rdf::Record<MoveJ>& r) {
  r.facets("joints").unit(lrt::unit::radian);
  r.facets("speed").unit(lrt::unit::radian_per_second).above(0);
}
inline void lrt_describe(lrt::rdf::Record<MoveL>& r) { r.facets("speed").unit(lrt::unit::metre_per_second).above(0); }
inline void lrt_describe(lrt::rdf::Record<Wait>& r) { r.facets("seconds").unit(lrt::unit::second).at_least(0); }
inline void lrt_describe(lrt::rdf::Record<Tool>& r) { r.facets("mass").unit(lrt::unit::kilogram).at_least(0); }

}  // namespace cell

lrt::Thing cell_thing(cell::Program& program, const cell::Status& status) {
  lrt::Thing thing{"cell"};
  thing.property("program", [&program] { return program; }).on_write([&program](const cell::Program& taken) { program = taken; });
  thing.property("status", [&status] { return status; });
  return thing;
}
