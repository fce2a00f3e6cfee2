// The end of a program by exit() or a return from main, with Clients that were not destroyed: one
// in a local variable of main at std::exit(), one that a pointer keeps, one of C without a close.
#pragma once

#include <memory>

namespace swarmtalk::client {

class Engine;

/// `engine` gets its end_with_program() then, if it is still there. Any thread.
void end_with_program(const std::shared_ptr<Engine>& engine);

}  // namespace swarmtalk::client
