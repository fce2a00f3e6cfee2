-- Wireshark's dissector of SwarmTalk: air frames on EtherType 0x88B5 and UDP port 21332, and the
-- packets in them (docs/wire-format.md). Of sealed frames it shows the header;
-- `swarmtalk-cli capture PLAIN --from FILE --unseal KEY` writes captures that can be read.

local air = Proto("swarmtalk", "SwarmTalk")

local PROFILES = { [0] = "wifi", [1] = "kilobot", [2] = "classic2020", [3] = "footbot" }
local HEADER, POSE, KEY_ID, SESSION, TAG, LAST = 18, 7, 2, 6, 16, 6

local f = {
  version = ProtoField.uint8("swarmtalk.version", "Version"),
  flags = ProtoField.uint8("swarmtalk.flags", "Flags", base.HEX),
  has_pose = ProtoField.bool("swarmtalk.flags.pose", "Pose follows", 8, nil, 0x01),
  is_sealed = ProtoField.bool("swarmtalk.flags.sealed", "Sealed", 8, nil, 0x02),
  is_beacon = ProtoField.bool("swarmtalk.flags.beacon", "Beacon", 8, nil, 0x04),
  is_fresh = ProtoField.bool("swarmtalk.flags.fresh", "Sealed, and shows that it is of now", 8, nil, 0x08),
  length = ProtoField.uint16("swarmtalk.length", "Length"),
  profile = ProtoField.uint8("swarmtalk.profile", "Profile", base.DEC, PROFILES),
  is_ghost = ProtoField.bool("swarmtalk.ghost", "Ghost: a simulated robot", 8, nil, 0x01),
  transmitter = ProtoField.uint16("swarmtalk.transmitter", "Transmitter"),
  epoch = ProtoField.uint32("swarmtalk.epoch", "Epoch", base.HEX),
  counter = ProtoField.uint32("swarmtalk.counter", "Frame counter"),
  x = ProtoField.double("swarmtalk.pose.x", "x (m)"),
  y = ProtoField.double("swarmtalk.pose.y", "y (m)"),
  theta = ProtoField.double("swarmtalk.pose.theta", "theta (degrees)"),
  age = ProtoField.string("swarmtalk.pose.age", "Age"),
  key_id = ProtoField.bytes("swarmtalk.key_id", "Key id"),
  session = ProtoField.bytes("swarmtalk.session", "Session"),
  ciphertext = ProtoField.bytes("swarmtalk.ciphertext", "Ciphertext"),
  tag = ProtoField.bytes("swarmtalk.tag", "Tag"),
  last_channel = ProtoField.uint16("swarmtalk.last.channel", "Channel"),
  last_number = ProtoField.uint32("swarmtalk.last.number", "Last message"),
  sender = ProtoField.uint16("swarmtalk.sender", "Sender (origin)"),
  message = ProtoField.uint32("swarmtalk.message", "Message number"),
  sequence = ProtoField.uint16("swarmtalk.sequence", "Fragment"),
  is_end = ProtoField.bool("swarmtalk.end", "Last fragment"),
  channel = ProtoField.uint16("swarmtalk.channel", "Channel"),
  ttl = ProtoField.uint8("swarmtalk.ttl", "TTL"),
  hops = ProtoField.uint8("swarmtalk.hops", "Hops"),
  size = ProtoField.uint16("swarmtalk.size", "Message size"),
  sender_epoch = ProtoField.uint16("swarmtalk.sender_epoch", "Sender's epoch", base.HEX),
  is_timestamped = ProtoField.bool("swarmtalk.timestamped", "Timestamped"),
  crossed_gateway = ProtoField.bool("swarmtalk.crossed_gateway", "Crossed a gateway"),
  parities = ProtoField.uint8("swarmtalk.parities", "Parity packets of the message"),
  is_parity = ProtoField.bool("swarmtalk.is_parity", "Parity packet"),
  delay = ProtoField.uint32("swarmtalk.delay_us", "Time in buffers (us)"),
  payload = ProtoField.bytes("swarmtalk.payload", "Payload"),
  checksum = ProtoField.uint8("swarmtalk.checksum", "Checksum", base.HEX),
}
local fields = {}
for _, field in pairs(f) do fields[#fields + 1] = field end
air.fields = fields

local e = {
  version = ProtoExpert.new("swarmtalk.other_version", "Another version of the air frame",
    expert.group.UNDECODED, expert.severity.WARN),
  flags = ProtoExpert.new("swarmtalk.unknown_flags", "Flags that this version does not know",
    expert.group.UNDECODED, expert.severity.WARN),
  truncated = ProtoExpert.new("swarmtalk.truncated", "The frame is cut off",
    expert.group.MALFORMED, expert.severity.ERROR),
  packet = ProtoExpert.new("swarmtalk.bad_packet_length", "The length of a packet is impossible",
    expert.group.MALFORMED, expert.severity.ERROR),
  checksum = ProtoExpert.new("swarmtalk.bad_checksum", "The checksum does not fit",
    expert.group.CHECKSUM, expert.severity.ERROR),
  sealed = ProtoExpert.new("swarmtalk.sealed",
    "Sealed; to read it: swarmtalk-cli capture PLAIN --from FILE --unseal KEY",
    expert.group.SECURITY, expert.severity.CHAT),
}
local experts = {}
for _, each in pairs(e) do experts[#experts + 1] = each end
air.experts = experts

local function add_pose(buffer, tree)
  local branch = tree:add(air, buffer, "Pose")
  local age = buffer(6, 1):uint()
  if age == 255 then
    branch:append_text(": stale")
    branch:add(f.age, buffer(6, 1), "stale")
    return
  end
  local x, y = buffer(0, 2):int() / 1000, buffer(2, 2):int() / 1000
  local theta = buffer(4, 2):uint() * 360 / 65536
  branch:add(f.x, buffer(0, 2), x)
  branch:add(f.y, buffer(2, 2), y)
  branch:add(f.theta, buffer(4, 2), theta)
  branch:add(f.age, buffer(6, 1),
    (age == 254 and "at least " or "") .. string.format("%.2f s", age / 100))
  branch:append_text(string.format(": x %.3f m, y %.3f m, %.1f degrees", x, y, theta))
end

-- Packets: each returns a line for the packet list, or nil when it is cut off.

local function wifi_packet(buffer, tree)
  if buffer:len() < 17 then return nil end
  local bits = buffer(6, 2):uint()
  local sequence, is_end = math.floor(bits / 2), bits % 2 == 1
  local flags = buffer(16, 1):uint()
  local is_timestamped, crossed = flags >= 128, flags % 128 >= 64
  tree:add(f.sender, buffer(0, 2))
  tree:add(f.message, buffer(2, 4))
  tree:add(f.sequence, buffer(6, 2), sequence)
  tree:add(f.is_end, buffer(7, 1), is_end)
  tree:add(f.channel, buffer(8, 2))
  tree:add(f.ttl, buffer(10, 1))
  tree:add(f.hops, buffer(11, 1))
  tree:add(f.size, buffer(12, 2))
  tree:add(f.sender_epoch, buffer(14, 2))
  tree:add(f.is_timestamped, buffer(16, 1), is_timestamped)
  tree:add(f.crossed_gateway, buffer(16, 1), crossed)
  local parities = math.floor(flags % 64 / 4)
  local full = is_timestamped and 1379 or 1383
  local is_parity = parities > 0 and sequence >= math.ceil(buffer(12, 2):uint() / full)
  if parities > 0 then
    tree:add(f.parities, buffer(16, 1), parities)
    tree:add(f.is_parity, buffer(6, 2), is_parity)
  end
  local rest = buffer:len() - 17
  if is_timestamped and rest >= 4 then
    rest = rest - 4
    tree:add_le(f.delay, buffer(17 + rest, 4))
  end
  if rest > 0 then tree:add(f.payload, buffer(17, rest)) end
  return string.format("robot %d, channel %d, message %d%s", buffer(0, 2):uint(),
    buffer(8, 2):uint(), buffer(2, 4):uint(),
    is_parity and ", parity" or (is_end and sequence == 0) and ""
      or string.format(", fragment %d", sequence))
end

local function small_packet(buffer, tree, has_checksum)
  local checked = has_checksum and 1 or 0
  if buffer:len() < 3 + checked then return nil end
  tree:add(f.sender, buffer(0, 1), buffer(0, 1):uint())
  tree:add(f.message, buffer(1, 1), buffer(1, 1):bitfield(0, 4))
  tree:add(f.sequence, buffer(1, 1), buffer(1, 1):bitfield(4, 3))
  tree:add(f.is_end, buffer(1, 1), buffer(1, 1):bitfield(7, 1) == 1)
  tree:add(f.channel, buffer(2, 1), buffer(2, 1):bitfield(0, 4))
  tree:add(f.ttl, buffer(2, 1), buffer(2, 1):bitfield(4, 4))
  local last = buffer:len() - checked
  if last > 3 then tree:add(f.payload, buffer(3, last - 3)) end
  if has_checksum then
    local sum = 0
    for i = 0, last - 1 do sum = (sum + buffer(i, 1):uint()) % 256 end
    local item = tree:add(f.checksum, buffer(last, 1))
    if sum ~= buffer(last, 1):uint() then item:add_proto_expert_info(e.checksum) end
  end
  return string.format("robot %d, channel %d, message %d, fragment %d", buffer(0, 1):uint(),
    buffer(2, 1):bitfield(0, 4), buffer(1, 1):bitfield(0, 4), buffer(1, 1):bitfield(4, 3))
end

local function add_packets(buffer, profile, tree)
  local at, lines = 0, {}
  while at + 2 <= buffer:len() do
    local size = buffer(at, 2):uint()
    if size == 0 or at + 2 + size > buffer:len() then break end
    local packet = buffer(at + 2, size):tvb()
    local branch = tree:add(air, buffer(at, 2 + size), "Packet")
    local line
    if profile == 0 then
      line = wifi_packet(packet, branch)
    elseif profile <= 3 then
      line = small_packet(packet, branch, profile ~= 2)
    end
    branch:append_text(line and ": " .. line or string.format(" of %d bytes", size))
    lines[#lines + 1] = line or "packet"
    at = at + 2 + size
  end
  if at < buffer:len() then
    tree:add(air, buffer(at), "Unreadable"):add_proto_expert_info(e.packet)
  end
  return #lines == 0 and "no packets" or table.concat(lines, "; ")
end

local function add_last_messages(buffer, tree)
  local count = math.floor(buffer:len() / LAST)
  for i = 0, count - 1 do
    local branch = tree:add(air, buffer(i * LAST, LAST), "Last message")
    branch:add(f.last_channel, buffer(i * LAST, 2))
    branch:add(f.last_number, buffer(i * LAST + 2, 4))
  end
  if count * LAST < buffer:len() then
    tree:add(air, buffer(count * LAST), "Unreadable"):add_proto_expert_info(e.packet)
  end
  return string.format("beacon, %d channels", count)
end

local function add_sealed(buffer, tree)
  if buffer:len() < KEY_ID + SESSION + TAG then return nil end
  tree:add(f.key_id, buffer(0, KEY_ID))
  tree:add(f.session, buffer(KEY_ID, SESSION))
  local from, to = KEY_ID + SESSION, buffer:len() - TAG
  if to > from then tree:add(f.ciphertext, buffer(from, to - from)) end
  tree:add(f.tag, buffer(to, TAG)):add_proto_expert_info(e.sealed)
  return string.format("sealed, %d bytes", to - from)
end

local function add_body(buffer, flags, profile, tree)
  local has_pose, is_sealed, is_beacon = flags % 2 == 1, flags % 4 >= 2, flags % 8 >= 4
  if is_sealed then return add_sealed(buffer, tree) end
  local at = 0
  if has_pose then
    if buffer:len() < POSE then return nil end
    add_pose(buffer(0, POSE), tree)
    at = POSE
  end
  if at == buffer:len() then return is_beacon and "beacon" or "no packets" end
  local rest = buffer(at):tvb()
  if is_beacon then return add_last_messages(rest, tree) end
  return add_packets(rest, profile, tree)
end

function air.dissector(buffer, info, root)
  if buffer:len() < 2 or buffer(0, 2):string() ~= "ST" then return 0 end
  info.cols.protocol = "SwarmTalk"
  local tree = root:add(air, buffer())
  if buffer:len() < HEADER then
    tree:add_proto_expert_info(e.truncated)
    return buffer:len()
  end
  local version = tree:add(f.version, buffer(2, 1))
  if buffer(2, 1):uint() ~= 1 then
    version:add_proto_expert_info(e.version)
    info.cols.info = "version " .. buffer(2, 1):uint()
    return buffer:len()
  end
  local flags = buffer(3, 1):uint()
  local branch = tree:add(f.flags, buffer(3, 1))
  branch:add(f.has_pose, buffer(3, 1))
  branch:add(f.is_sealed, buffer(3, 1))
  branch:add(f.is_beacon, buffer(3, 1))
  branch:add(f.is_fresh, buffer(3, 1))
  local is_known = flags < 8 or (flags < 16 and flags % 4 >= 2)
  if not is_known then branch:add_proto_expert_info(e.flags) end
  tree:add(f.length, buffer(4, 2))
  tree:add(f.profile, buffer(6, 1))
  tree:add(f.is_ghost, buffer(7, 1))
  tree:add(f.transmitter, buffer(8, 2))
  tree:add(f.epoch, buffer(10, 4))
  tree:add(f.counter, buffer(14, 4))
  local length = buffer(4, 2):uint()
  local line
  if length >= HEADER and length <= buffer:len() and is_known then
    line = length == HEADER and (flags % 8 >= 4 and "beacon" or "no packets")
      or add_body(buffer(HEADER, length - HEADER):tvb(), flags, buffer(6, 1):uint(), tree)
  end
  if not line and is_known then tree:add_proto_expert_info(e.truncated) end
  info.cols.info = string.format("from %d: %s", buffer(8, 2):uint(), line or "unreadable")
  return buffer:len()
end

DissectorTable.get("ethertype"):add(0x88B5, air)
DissectorTable.get("udp.port"):add(21332, air)
