//! taut
fn main(){}
