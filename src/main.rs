//! The command line. Its verbs arrive as what they drive does; until then it shows the robot that is built in.

fn main() {
    print!("{}", guidedog::robot::anymal_d().tree_text());
}
