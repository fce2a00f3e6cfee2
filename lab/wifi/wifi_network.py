"""Wi-Fi networks between the radios of a guest, in the modes that robots use. Everything is set by
the programs that a robot would use: iw, hostapd, wpa_supplicant.
"""
import hashlib
import signal

from wifi_guest import Guest, GuestError, Process

SSID = "swarm"
PASSPHRASE = "kilobots"
CELL = "02:11:22:33:44:55"  # an IBSS that all join at once needs its id said beforehand
MODES = ("ap", "ap-isolated", "ibss", "mesh")
JOIN_TIMEOUT_S = 60
SETTLED = {  # a line for the shell that succeeds once a robot is part of the network
    "ap": "wpa_cli -p /run/wpa-{robot} -i wlan0 status | grep -q ^wpa_state=COMPLETED",
    "ap-isolated": "wpa_cli -p /run/wpa-{robot} -i wlan0 status | grep -q ^wpa_state=COMPLETED",
    "ibss": "iw dev wlan0 link | grep -q '^Joined IBSS'",
    "mesh": "test $(iw dev wlan0 station dump | grep -c 'mesh plink:.*ESTAB') -ge {peers}",
}


def key() -> str:
    """The pairwise master key of SSID and PASSPHRASE, IEEE 802.11-2020, J.4.1: computed out here,
    as it costs seconds in there."""
    return hashlib.pbkdf2_hmac("sha1", PASSPHRASE.encode(), SSID.encode(), 4096, 32).hex()


def frequency(channel: int) -> int:
    """Middle of a channel in MHz: 1 to 13 of the 2.4 GHz band, from 32 on of the 5 GHz band."""
    return 2407 + 5 * channel if channel < 14 else 5000 + 5 * channel


def hostapd_settings(name: str, channel: int, is_isolating: bool, basic_rates: str,
                     more: dict) -> str:
    settings = {
        "interface": "wlan0", "driver": "nl80211", "ssid": SSID, "channel": channel,
        "hw_mode": "g" if channel < 14 else "a", "ctrl_interface": f"/run/hostapd-{name}",
        "wpa": 2, "wpa_psk": key(), "wpa_key_mgmt": "WPA-PSK", "rsn_pairwise": "CCMP",
        "ap_isolate": int(is_isolating)}
    if basic_rates:
        settings["basic_rates"] = basic_rates
    settings.update(more)
    return "".join(f"{name}={value}\n" for name, value in settings.items())


class Network:
    """One network of some robots. down() leaves the radios as they were."""

    def __init__(self, guest: Guest, mode: str, robots=None, channel: int = 1,
                 mcast_rate: str = "6", basic_rates: str = "60 120 240", hostapd=None,
                 wired: str | None = None, stays: bool = False):
        """@param mode         ap: clients of an access point with WPA2; ap-isolated: one that keeps
                              its clients apart; ibss; mesh: 802.11s
        @param robots       names; default: all
        @param mcast_rate   of ibss and mesh, Mbit/s
        @param basic_rates  of ap, in 100 kbit/s as hostapd takes them; empty: hostapd's own
        @param hostapd      more of its settings, or other ones
        @param wired        a second access point of the same network, on another channel; a wire
                            joins the two, as in a building (needs the modules bridge and veth)
        @param stays        its programs run on when this process ends
        @raises GuestError when a robot has not joined within a minute"""
        self.guest, self.mode, self.channel = guest, mode, channel
        self.robots = list(robots or guest.robots)
        self.programs: dict[str, Process] = {}
        self.stays = stays
        self.access_points = {}  # name -> channel
        if mode.startswith("ap"):
            self.access_points["ap1"] = channel
            if wired:
                self.access_points[wired] = channel + 5
                self._join_by_wire(wired)
            for name, own_channel in self.access_points.items():
                more = {**({"bridge": "br0"} if wired else {}), **(hostapd or {})}
                guest.put(f"hostapd-{name}.conf", hostapd_settings(
                    name, own_channel, mode == "ap-isolated", basic_rates, more))
                self.start_access_point(name)
            for robot in self.robots:
                self.start_supplicant(robot)
        elif mode in MODES:
            self._join(mcast_rate)
        else:
            raise GuestError(f"no mode {mode}; there are {', '.join(MODES)}")
        self.wait_until_joined()

    def start_access_point(self, name: str = "ap1"):
        """Starts hostapd, or starts it again as it was."""
        path = str(self.guest.folder / f"hostapd-{name}.conf")
        if self.stays:
            self.guest.check(name, "hostapd", "-B", path)
            return
        self.programs[name] = self.guest.start(name, "hostapd", path)
        self.programs[name].wait_for(
            lambda process: "AP-ENABLED" in process.stdout, JOIN_TIMEOUT_S, "AP-ENABLED")

    def stop_access_point(self, name: str = "ap1"):
        """Ends hostapd, which says goodbye to its clients."""
        self.programs.pop(name).end()

    def pull_plug(self, name: str = "ap1"):
        """Ends hostapd without a goodbye, and its beacons with it."""
        process = self.programs.pop(name)
        process.signal(signal.SIGKILL)
        process.wait(20)
        self.guest.check(name, "ip link set wlan0 down")

    def _join_by_wire(self, other: str):
        self.guest.check("", f"ip link add wire netns ap1 type veth peer name wire netns {other}")
        for name in ("ap1", other):
            self.guest.check(name, "set -e; ip link add br0 type bridge; ip link set br0 up; "
                                   "ip link set wire master br0 up")

    def start_supplicant(self, robot: str):
        channels = " ".join(str(frequency(each)) for each in self.access_points.values())
        path = self.guest.put(f"supplicant-{robot}.conf",
                              f"ctrl_interface=/run/wpa-{robot}\nap_scan=1\nnetwork={{\n"
                              f"  ssid=\"{SSID}\"\n  psk={key()}\n  key_mgmt=WPA-PSK\n"
                              f"  scan_freq={channels}\n}}\n")
        command = ["wpa_supplicant", "-D", "nl80211", "-i", "wlan0", "-c", str(path)]
        if self.stays:
            self.guest.check(robot, *command, "-B")
        else:
            self.programs[robot] = self.guest.start(robot, *command)

    def supplicant(self, robot: str, *words) -> str:
        """A command of wpa_cli. @return its answer"""
        return self.guest.check(robot, "wpa_cli", "-p", f"/run/wpa-{robot}", "-i", "wlan0", *words)

    def roam(self, robot: str, name: str):
        """Sends a robot to another access point, as its own program does when that is stronger."""
        target = self.address(name)
        tries = JOIN_TIMEOUT_S
        while f"bssid={target}" not in self.supplicant(robot, "status"):
            tries -= 1
            if tries == 0:
                raise GuestError(f"{robot} does not go to {name}")
            self.supplicant(robot, "scan")
            self.guest.run("", "sleep 1")
            self.supplicant(robot, "roam", target)
            self.guest.run("", "sleep 1")
        self.wait_until_joined([robot])

    def address(self, name: str) -> str:
        return self.guest.check(name, "cat /sys/class/net/wlan0/address").strip()

    def sleep(self, robot: str, is_asleep: bool):
        """Power save of a station: it tells the access point that it sleeps, by the radio's debugfs
        (iw cannot: this driver refuses). It is awake again, to the access point, when it sends."""
        number = self.guest.robots.index(robot)
        self.guest.check("", "[ -d /sys/kernel/debug/ieee80211 ] || "
                             "mount -t debugfs debugfs /sys/kernel/debug; "
                             f"echo {2 if is_asleep else 0} > "
                             f"/sys/kernel/debug/ieee80211/phy{number}/hwsim/ps")

    def _join(self, mcast_rate: str):
        frequency_mhz = frequency(self.channel)
        kind, join = {
            "ibss": ("ibss", f"ibss join {SSID} {frequency_mhz} fixed-freq {CELL} "
                             f"basic-rates {mcast_rate} mcast-rate {mcast_rate}"),
            "mesh": ("mp", f"mesh join {SSID} freq {frequency_mhz} mcast-rate {mcast_rate}"),
        }[self.mode]
        for robot in self.robots:
            self.guest.check(robot, f"set -e; ip link set wlan0 down; "
                                    f"iw dev wlan0 set type {kind}; ip link set wlan0 up; "
                                    f"iw dev wlan0 {join}")

    def wait_until_joined(self, robots=None):
        """Until each of the robots is part of the network."""
        for robot in robots or self.robots:
            line = SETTLED[self.mode].format(robot=robot, peers=len(self.robots) - 1)
            tries = JOIN_TIMEOUT_S * 4
            done = self.guest.run(robot, f"i=0; until {line}; do i=$((i + 1)); "
                                         f"[ $i -lt {tries} ] || exit 1; sleep 0.25; done "
                                         "2>/dev/null", timeout=JOIN_TIMEOUT_S * 3)
            if done.returncode != 0:
                raise GuestError(f"{robot} has not joined ({self.mode}): "
                                 + self.guest.run(robot, "iw dev wlan0 info; iw dev wlan0 link; "
                                                         "iw dev wlan0 station dump").stdout)

    def down(self):
        """Ends its programs; radios are stations without a network again."""
        for process in self.programs.values():
            process.end()
            process.close()
        self.programs.clear()
        for name in [*self.robots, *self.access_points]:
            self.guest.check(name, "ip link set wlan0 down; iw dev wlan0 set type managed")
        if len(self.access_points) > 1:
            for name in self.access_points:
                self.guest.run(name, "ip link del br0; ip link del wire 2>/dev/null")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.down()
