"""The program news: who is reached, what copies do, what is refused."""
from test_runner import results, suite

NEWS = "program = 'news'\nrobots = 25\nseconds = 40\n"


def news(folder, text: str, *arguments) -> list[dict]:
    (folder / "s.toml").write_text(NEWS + text)
    return results(suite(folder, "run", "--scenario", "s.toml", *arguments))


def test_news_reach_as_far_as_their_ttl(tmp_path):
    """A line of three hops: with TTL 1 the last robot is out of reach, and nobody's loss."""
    runs = news(tmp_path, "radio.range_mm = 60\nmessage.ttl = 1\n", "--runs", 3)
    assert all(r["success"] and r["delivery"] > 0.95 for r in runs), runs
    log = (tmp_path / "suite-logs/news-sim-kilobot-25-s-1.jsonl").read_text()
    near = log.count('"heard"')
    news(tmp_path, "radio.range_mm = 60\nmessage.ttl = 7\n", "--runs", 1)
    log = (tmp_path / "suite-logs/news-sim-kilobot-25-s-1.jsonl").read_text()
    assert log.count('"heard"') > 1.3 * near


def test_lost_packets_are_lost_news_and_copies_bring_them(tmp_path):
    once = news(tmp_path, "radio.loss = 0.5\nradio.range_mm = 60\nmessage.period_ms = 9000\n",
                "--runs", 4)
    twice = news(tmp_path, "radio.loss = 0.5\nradio.range_mm = 60\nmessage.period_ms = 9000\n"
                 "message.copies = 2\n", "--runs", 4)
    assert sum(r["delivery"] for r in once) < 3.9
    assert sum(r["delivery"] for r in twice) > sum(r["delivery"] for r in once)
    assert sum(r["packets_per_s"] for r in twice) > 1.5 * sum(r["packets_per_s"] for r in once)


NONSENSE = [
    ("message.bytes = 2\n", "bytes is 2"), ("message.ttl = 16\n", "holds at most 15"),
    ("message.bytes = 64\n", "at most 40"), ("message.tellers = 25\n", "nobody listens"),
    ("message.loud = 1\n", "no key 'loud'"), ("platform = 'argos-footbot'\n", "does not run on")]


def test_nonsense_about_news_is_one_line(tmp_path):
    for text, says in NONSENSE:
        (tmp_path / "s.toml").write_text(NEWS + text)
        done = suite(tmp_path, "run", "--scenario", "s.toml")
        assert done.returncode == 1 and says in done.stderr, done
        assert done.stderr.count("\n") == 1, done


def test_other_programs_have_no_message_section(tmp_path):
    (tmp_path / "s.toml").write_text("program = 'hop_count'\nmessage.ttl = 1\n")
    assert "has no [message]" in suite(tmp_path, "run", "--scenario", "s.toml").stderr
