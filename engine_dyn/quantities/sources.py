"""Where the short names of sources, as parameters and quantities cite them, can be looked up."""

from __future__ import annotations

from collections.abc import Mapping

SOURCES: Mapping[str, str] = {
    "API": "American Petroleum Institute, Standard 618, Reciprocating compressors for petroleum, "
    "chemical, and gas industry services, 5th edition, paragraph 6.6.4 on the reversal of the rod "
    "load; as others give it, not compared page by page",
    "Asgari": "T. Asgari, A. Mohammadebrahim, N. Meyghani and H. Saraei, Development of balance "
    "shaft and flywheel for single cylinder diesel engine based on analytical approach and "
    "comparison with the simulation result, 2019; in Persian with an English abstract, KIASA "
    "Company and Arak University of Technology, Iran, published by the Iranian Society of Engine",
    "Biezeno": "C. B. Biezeno and R. Grammel, Technische Dynamik, Springer; not compared page by "
    "page",
    "Chen": "S. K. Chen and P. F. Flynn, Development of a single cylinder compression ignition "
    "research engine, SAE paper 650733, 1965, doi:10.4271/650733",
    "Eksergian": "R. Eksergian, Dynamical analysis of machines, Journal of the Franklin Institute, "
    "in parts, volumes 209 to 211, 1930 and 1931",
    "Heywood": "J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill, 1988",
    "Kakaitsas": "A. S. Kakaitsas, Ανομοιομορφία περιστροφής εμβολοφόρων κινητήρων: υπολογιστική "
    "μελέτη και παραμετρική ανάλυση (Rotational irregularity of piston engines: computational "
    "study and parametric analysis), diploma thesis, supervised by E. G. Giakoumis, National "
    "Technical University of Athens, School of Mechanical Engineering, October 2015; in Greek",
    "IACS": "International Association of Classification Societies, Unified Requirement M68, "
    "dimensions of propulsion shafts and their permissible torsional vibration stresses",
    "Ker": "W. Ker Wilson, Practical Solution of Torsional Vibration Problems, Chapman and Hall; "
    "the method as textbooks give it, not compared page by page",
    "Khurmi": "R. S. Khurmi and J. K. Gupta, Theory of Machines, S. Chand; the definitions as the "
    "book's public companions give them, not compared page by page",
    "Kloss": "M. Kloss on torque and slip of induction motors, usually dated 1908; the formula as "
    "textbooks of electrical machines give it",
    "Kundur": "P. Kundur, Power System Stability and Control, McGraw-Hill, 1994; example 12.2, a "
    "generator on an infinite bus, as others reprint its numbers",
    "Mosakowski": "R. Mosakowski, Zależności na parametry kinematyczne mechanizmu korbowego w "
    "nowym ujęciu (New form of relations for calculating kinematic parameters of crank mechanism), "
    "Gdańsk University of Technology, Department of Internal Combustion Engines and Compressors; "
    "in Polish with an English summary, year and journal are not printed in the copy used",
    "Norton": "R. L. Norton, Design of Machinery, McGraw-Hill: offset slider-crank",
    "Patton": "K. J. Patton, R. C. Nitschke and J. B. Heywood, Development and evaluation of a "
    "friction model for spark-ignition engines, SAE paper 890836, 1989, doi:10.4271/890836",
    "Power": "Power units, lecture 18: Силовые агрегаты, лекция 18, Уравновешивание двигателей "
    "(Balancing of engines), slides of a lecture in Russian; author, institution and year are not "
    "given in the copy used, and no public address is known",
    "Rakopoulos": "Notes in Greek after the book by C. D. Rakopoulos, professor at the National "
    "Technical University of Athens, ΜΕΚ ΙΙ: Εμβάθυνση στην κατασκευή και λειτουργία (Internal "
    "combustion engines II); author and year of the notes are not given in the copy used, and no "
    "public address is known",
    "Rezeka": "S. F. Rezeka and N. A. Henein, A new approach to evaluate instantaneous friction "
    "and its components in internal combustion engines, SAE paper 840179, 1984, "
    "doi:10.4271/840179",
}
"""Full citations, by the first word of the short name that `Node.source` begins with."""
