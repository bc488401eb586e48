"""The traction memory of asperities: which spring of a contact was anchored where, exactly, for any load history.

By the method of dimensionality reduction a Hertz contact is a row of independent springs. A spring is labelled by the
approach ``a`` of the highest summit at which it first touches. With the tangential displacement divided by
θ = E*/(4G*), the whole history of all asperities that share one friction coefficient is one function, the anchor
``w(a)`` of the springs, on labels up to the present approach ``d``. A spring's deflection is v = V - w, Coulomb's law
says ``|v(a)| <= μ (d - a)``, and w is piecewise linear. Its vertices are kept as a stack, the deepest first and the
contact edge (d, V) last, so that an event touches the outer end alone. The load of an asperity at approach a, with gap
h below the highest summit, is ``N(a) = k (a - h)^(3/2)``; P is the sum of N over a friction group, and

    T = Σ_j m_j [P(a_j) - P(a_{j-1})],   m_j = dw/da between vertices j-1 and j

holds for a group and, with N in the place of P, for each of its asperities (theory of Jäger and Ciavarella; memory
diagrams of Aleshin et al.). Slip sets m = ±μ from the edge to one slip front.

Everything here is dimensionless: lengths over the largest summit radius R0, loads over (4/3) E* R0², k = √(R/R0),
tangential displacements over θ R0. Tolerances are relative.
"""
