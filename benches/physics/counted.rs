//! A number that counts what is done with it: one robot's share of a step's operations.

use std::{
    cell::Cell,
    fmt,
    ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign},
};

use spatial::{Lane, Mask};

/// Operations by kind.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Operations {
    /// Fused multiply-adds.
    fused: u64,
    /// Additions, subtractions and multiplications by themselves.
    simple: u64,
    /// Divisions and square roots.
    slow: u64,
    /// Sine-cosine pairs.
    trigonometric: u64,
    /// Comparisons, choices, minima, absolute values and changes of sign: no arithmetic, but instructions.
    logic: u64,
}

impl Operations {
    /// Arithmetic operations; a fused one counts as two, a sine and cosine as the twenty of its polynomials.
    pub(crate) fn flops(&self) -> f64 {
        (2 * self.fused + self.simple + self.slow + 20 * self.trigonometric) as f64
    }

    /// The mean of `count` steps.
    pub(crate) fn per(self, count: u64) -> Self {
        Self {
            fused: self.fused / count,
            simple: self.simple / count,
            slow: self.slow / count,
            trigonometric: self.trigonometric / count,
            logic: self.logic / count,
        }
    }
}

impl fmt::Display for Operations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { fused, simple, slow, trigonometric, logic } = self;
        write!(
            f,
            "{fused} fused, {simple} simple, {slow} divisions and roots, {trigonometric} sine-cosines; {logic} of logic"
        )
    }
}

thread_local! {
    static COUNT: Cell<Operations> = const {
        Cell::new(Operations { fused: 0, simple: 0, slow: 0, trigonometric: 0, logic: 0 })
    };
}

/// What has been counted since the last call.
pub(crate) fn take() -> Operations {
    COUNT.take()
}

fn count(kind: impl FnOnce(&mut Operations)) {
    COUNT.with(|cell| {
        let mut operations = cell.get();
        kind(&mut operations);
        cell.set(operations);
    });
}

/// A number that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Counted(f64);

macro_rules! simple {
    ($($trait:ident $method:ident $kind:ident),*) => {$(
        impl $trait for Counted {
            type Output = Self;
            fn $method(self, o: Self) -> Self {
                count(|n| n.$kind += 1);
                Self(self.0.$method(o.0))
            }
        }
    )*};
}
simple!(Add add simple, Sub sub simple, Mul mul simple, Div div slow);

macro_rules! assigning {
    ($($trait:ident $method:ident $operator:tt),*) => {$(
        impl $trait for Counted {
            fn $method(&mut self, o: Self) {
                *self = *self $operator o;
            }
        }
    )*};
}
assigning!(AddAssign add_assign +, SubAssign sub_assign -, MulAssign mul_assign *);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        count(|n| n.logic += 1);
        Self(-self.0)
    }
}

/// A truth value that counts.
#[derive(Clone, Copy)]
pub(crate) struct Truth(bool);

impl Mask<Counted> for Truth {
    fn select(self, if_true: Counted, if_false: Counted) -> Counted {
        count(|n| n.logic += 1);
        if self.0 { if_true } else { if_false }
    }
    fn and(self, other: Self) -> Self {
        count(|n| n.logic += 1);
        Self(self.0 & other.0)
    }
    fn or(self, other: Self) -> Self {
        count(|n| n.logic += 1);
        Self(self.0 | other.0)
    }
    fn any(self) -> bool {
        self.0
    }
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Counted {
    fn logic(x: f64) -> Self {
        count(|n| n.logic += 1);
        Self(x)
    }
    fn truth(x: bool) -> Truth {
        count(|n| n.logic += 1);
        Truth(x)
    }
}

impl Lane for Counted {
    const WIDTH: usize = 1;
    type Mask = Truth;
    type Scalar = f64;
    type Indices = [u32; 1];

    fn scalar(x: f64) -> f64 {
        x
    }
    fn broadcast(x: f64) -> Self {
        Self(x)
    }
    fn floor(self) -> Self {
        Self::logic(self.0.floor())
    }
    fn indices(self, count: usize) -> [u32; 1] {
        self.0.indices(count)
    }
    fn gather(table: &[[f32; 16]], rows: &[u32; 1]) -> [Self; 16] {
        f64::gather(table, rows).map(Self)
    }
    fn splat(x: f64) -> Self {
        Self(x)
    }
    fn get(&self, _lane: usize) -> f64 {
        self.0
    }
    fn set(&mut self, _lane: usize, x: f64) {
        self.0 = x;
    }
    fn mul_add(self, a: Self, b: Self) -> Self {
        count(|n| n.fused += 1);
        Self(self.0.mul_add(a.0, b.0))
    }
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        count(|n| n.fused += 1);
        Self((-self.0).mul_add(a.0, b.0))
    }
    fn sqrt(self) -> Self {
        count(|n| n.slow += 1);
        Self(self.0.sqrt())
    }
    fn min(self, other: Self) -> Self {
        Self::logic(self.0.min(other.0))
    }
    fn max(self, other: Self) -> Self {
        Self::logic(self.0.max(other.0))
    }
    fn sin_cos(self) -> (Self, Self) {
        count(|n| n.trigonometric += 1);
        let (s, c) = self.0.sin_cos();
        (Self(s), Self(c))
    }
    fn lt(self, other: Self) -> Truth {
        Self::truth(self.0 < other.0)
    }
    fn le(self, other: Self) -> Truth {
        Self::truth(self.0 <= other.0)
    }
    fn gt(self, other: Self) -> Truth {
        Self::truth(self.0 > other.0)
    }
    fn ge(self, other: Self) -> Truth {
        Self::truth(self.0 >= other.0)
    }
}
