// Ctrl-C and termination while a lab is coming up or running: remembered, so that everything is
// taken down on the way out.
#pragma once

namespace swarmtalk::lab {

/// From now on SIGINT, SIGTERM and SIGHUP, as far as they are not ignored, are remembered instead
/// of ending this process. Programs started afterwards have the default behaviour.
void remember_interrupts();

/// The last such signal, or 0.
int interrupted();

/// Throws std::runtime_error when there was one.
void throw_if_interrupted();

}  // namespace swarmtalk::lab
