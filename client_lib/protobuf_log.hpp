// protobuf writes "[libprotobuf ERROR ..." to stderr when a string of a message is not UTF-8. What
// concerns our protocol is told by a Status; a program of its own keeps protobuf's lines.
#pragma once

namespace swarmtalk::client {

/// Leaves out protobuf's lines about frames of the local protocol, hands all others to the handler
/// that was set before. Once in a process; further calls do nothing. Any thread.
void filter_protobuf_log();

}  // namespace swarmtalk::client
