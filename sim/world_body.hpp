// Motion, contacts and faults of World. Part of world.hpp.
#pragma once

#include "sim/world.hpp"

namespace swarmtalk::sim {

/// One step of a body that drives. Whoever is near has to find out anew whom it reaches.
template <class P>
void World<P>::move(uint32_t index, Robot& robot) {
  Body& body = robot.body;
  forget_links_near(body);
  body.advance(config_.body, kTickUs * 1e-6, robot.random);
  grid_.move(index, body.x_mm, body.y_mm);
  bool touches = false;
  grid_.for_near(body.x_mm, body.y_mm, [&](uint32_t other) {
    if (other != index) {
      touches |= push_apart(body, robots_[other]->body, config_.body.diameter_mm);
    }
  });
  if (touches) {
    ++robot.contacts;
    ++air_.contacts;
    grid_.move(index, body.x_mm, body.y_mm);
  }
  robot.knows_links = false;
  forget_links_near(body);
}

template <class P>
void World<P>::start_fault(const Fault& fault) {
  if (interference_.begin(fault)) return;
  if (fault.robot >= size()) return;
  Robot& robot = *robots_[fault.robot];
  if (fault.kind == Fault::Kind::kClockStep) {
    robot.clock.jump(fault.ticks);
    return;
  }
  interrupt_reception(robot);
  robot.body.drive(0, 0);
  const bool was_alive = robot.is_alive;
  robot.is_alive = false;
  if (fault.kind == Fault::Kind::kDeath) return;
  robot.renew();
  robot.clock.restart(now_us_);
  if (hooks_.restart != nullptr) hooks_.restart(hooks_.context, fault.robot);
  if (was_alive) {
    robot.is_alive = true;  // its loop and its turns go on
  } else {
    switch_on(fault.robot, now_us_);
  }
}

}  // namespace swarmtalk::sim
